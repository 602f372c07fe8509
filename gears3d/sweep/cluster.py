"""A cluster by dask.distributed: the same blocks, on other machines."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from math import inf
from typing import TYPE_CHECKING, Any

from gears3d.errors import EngineError, Fault, InputError
from gears3d.extras import require
from gears3d.sweep.block import Block, Watch
from gears3d.sweep.models import compute, warm
from gears3d.sweep.plan import Plan

if TYPE_CHECKING:
    from distributed import Client

ANSWER_S = 10.0  # A scheduler that does not answer within this time is taken for none [s]
AHEAD = 3  # Blocks that are handed out for each thread of the cluster, so that memory stays bounded
REMEDY = "finished blocks are kept: give the same command again when the scheduler is back"


def compute_there(plan: Plan, key: str, begin: int, end: int, limit: float) -> Block:
    """Run a block on a worker of the cluster."""
    if plan.key != key:
        why = "a worker has another version of gears3d than this machine"
        raise InputError(Fault("--scheduler", why, "install the same version on all machines"))
    if limit < inf:
        warm(plan)
    return compute(plan, begin, end, Watch(limit))


class Cluster:
    """A dask cluster that runs the blocks of a sweep."""

    def __init__(self, plan: Plan, address: str, limit: float = inf) -> None:
        client = require("distributed", "a sweep on a cluster (--scheduler)", "sweep").Client
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        self.plan, self.address, self.limit = plan, address, limit
        try:
            self._client: Client = client(address, timeout=ANSWER_S, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            remedy = "start one with `dask scheduler`, or leave --scheduler out to use this machine"
            why = f"{address} does not answer within {ANSWER_S:g} s"
            if isinstance(error, ValueError | TypeError):
                why, remedy = f"{address!r} is not an address", "write tcp://HOST:PORT, e.g. tcp://127.0.0.1:8786"
                if address.startswith("tls:"):
                    why = f"{address} cannot be reached with TLS: {str(error).splitlines()[0]}"
                    remedy = "name the certificates in dask's configuration, distributed.comm.tls"
            raise InputError(Fault("--scheduler", why, remedy)) from None

    @property
    def workers(self) -> int:
        """Threads of all workers."""
        return sum(self._info().values())

    def _info(self) -> dict[str, int]:
        try:
            told = self._client.nthreads()
        except Exception as error:
            raise self._gone() from error
        return dict(told) if isinstance(told, dict) else {}

    def cpus(self) -> set[str]:
        """Return the CPU models of this machine and all workers; numbers are the same to the bit on one model only."""
        return {cpu_model(), *self._client.run(cpu_model).values()}  # type: ignore[union-attr]

    def _gone(self) -> EngineError:
        return EngineError(f"the scheduler at {self.address} is gone; {REMEDY}")

    def blocks(self, spans: Sequence[tuple[int, int]], tick: Callable[[int], None] | None = None) -> Iterator[Block]:
        """Run blocks and give them as they are finished, in any order."""
        waiting = list(reversed(spans))
        running: dict[Any, tuple[int, int]] = {}
        try:
            if not self._info():
                raise EngineError(
                    f"the scheduler at {self.address} has no workers; start some with `dask worker {self.address}`"
                )
            while waiting or running:
                while waiting and len(running) < AHEAD * max(self.workers, 1):
                    span = waiting.pop()
                    name = f"gears3d-{self.plan.key}-{span[0]}-{span[1]}"
                    asked = (self.plan, self.plan.key, *span, self.limit)
                    running[self._client.submit(compute_there, *asked, key=name, pure=True)] = span
                self._pause()
                if tick is not None:
                    tick(0)
                for future in [each for each in running if each.done()]:
                    span = running.pop(future)
                    yield self._result(future, span)
                    future.release()
        finally:
            for future in running:
                with suppress(Exception):
                    future.cancel()

    def close(self) -> None:
        """Leave the cluster."""
        with suppress(Exception):
            self._client.close(timeout=2.0)

    def _pause(self) -> None:
        import time

        time.sleep(0.05)
        if self._client.status != "running":
            raise self._gone()

    def _result(self, future: Any, span: tuple[int, int]) -> Block:
        from distributed import CancelledError, KilledWorker

        try:
            return future.result(timeout=ANSWER_S)
        except KilledWorker:
            why = f"points {span[0]} to {span[1] - 1} killed one worker after the other"
            raise EngineError(f"{why}; without --scheduler the point that does it is found and left out") from None
        except (CancelledError, OSError, TimeoutError) as error:
            raise self._gone() from error


def cpu_model() -> str:
    """Return the name of this machine's CPU model."""
    import platform
    from pathlib import Path

    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
