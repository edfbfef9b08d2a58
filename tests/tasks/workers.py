"""Workers that tests start, and some of which they kill."""

from collections.abc import Iterator

import dask
import pytest

from tribrach.tasks.cluster import local_workers
from tribrach.tasks.engine import Engine

__all__ = ["MAY_BE_RESET", "workers"]

#: For tests that kill workers. One that dies with a connection it had not accepted yet resets it,
#: and until Python 3.13 ``ssl.SSLSocket._create`` then raises without closing the socket, of which
#: nobody else knows (recv(1) of a socket without peer). Dask connects again.
MAY_BE_RESET = pytest.mark.filterwarnings("ignore:unclosed <ssl.SSLSocket:ResourceWarning")


@pytest.fixture(scope="module")
def workers() -> Iterator[Engine]:
    # where Dask's own patience was asked, no killed worker would come back
    impatient = {"distributed.deploy.lost-worker-timeout": "1 ms"}
    with dask.config.set(impatient), local_workers(2) as engine:
        yield engine
