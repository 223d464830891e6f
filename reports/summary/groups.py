"""Records put together by what they have in common."""


def by_key(records, key) -> dict:
    """Lists of records by their key, in the order in which keys come."""
    groups = {}
    for record in records:
        groups.setdefault(key(record), []).append(record)
    return groups
