"""The data files that a page is made of, as one archive beside it.

It holds them in their folders, and SHA256SUMS of them all; the same files make the same bytes.
Whoever unpacks it can read every number, check it with `sha256sum -c SHA256SUMS`, and make the page
again. Files may be left out that are too large to keep and that their program makes again from its
seeds: their checksums stand there too.
"""

import hashlib
import io
import os
import tarfile
from pathlib import Path

from markupsafe import Markup

from read.data import DataError


def archive(files: list[Path], left_out: list[Path] = ()) -> bytes:
    """A tar of the files, compressed by xz: no times, owners and folders of who made it. Of those
    left out, which are among the files, it has checksums alone."""
    paths = [Path(os.path.abspath(file)) for file in dict.fromkeys(files)]
    top = os.path.commonpath([path.parent.parent for path in paths])
    contents = {}
    for path in paths:
        try:
            contents[str(path.relative_to(top))] = path.read_bytes()
        except OSError as error:
            raise DataError(f"{path}: {error.strerror}") from None
    contents = dict(sorted(contents.items()))
    sums = "".join(
        f"{hashlib.sha256(content).hexdigest()}  {name}\n" for name, content in contents.items()
    )
    for path in left_out:
        del contents[str(Path(os.path.abspath(path)).relative_to(top))]
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w:xz", format=tarfile.PAX_FORMAT) as tar:
        for name, content in (contents | {"SHA256SUMS": sums.encode()}).items():
            entry = tarfile.TarInfo(name)
            entry.size = len(content)
            tar.addfile(entry, io.BytesIO(content))
    return packed.getvalue()


def link(path: Path, page: Path, packed: bytes, left_out: list[Path] = ()) -> Markup:
    """How the page names its archive."""
    named = Markup('<a href="{}">{}</a>, {:.1f} MB, SHA-256 <code>{}</code>').format(
        os.path.relpath(path, page.parent),
        path.name,
        len(packed) / 1e6,
        hashlib.sha256(packed).hexdigest(),
    )
    for file in left_out:
        named += f", without {file.name} ({file.stat().st_size / 1e6:.1f} MB)"
    return named
