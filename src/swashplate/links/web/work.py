"""Work of a page's request in a thread of its own, for which the end of the server does not wait."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from anyio.to_thread import current_default_thread_limiter


async def in_thread(work: Callable[..., Any], **given: Any) -> Any:
    """What `work` returns or raises; cancelled, the thread is left to itself and ends with the process.

    A long read cannot be stopped from outside, and one interrupt has to end the program.
    """
    loop = asyncio.get_running_loop()
    done: asyncio.Future[Any] = loop.create_future()

    def tell(result: Any, error: BaseException | None) -> None:
        if done.cancelled():
            return
        if error is None:
            done.set_result(result)
        else:
            done.set_exception(error)

    def run() -> None:
        result, raised = None, None
        try:
            result = work(**given)
        except BaseException as error:  # told to whoever waits
            raised = error
        with suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(tell, result, raised)

    async with current_default_thread_limiter():
        threading.Thread(target=run, daemon=True, name="request").start()
        return await done
