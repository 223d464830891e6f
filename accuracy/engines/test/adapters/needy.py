"""An engine of tests that nothing but a GPU could import."""

import cuda_of_nobody

from protocol import Engine


class Adapter(Engine):
    name = "Needy"
    package = cuda_of_nobody
    gpu = True
