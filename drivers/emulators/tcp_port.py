"""How does an emulated instrument listen on a TCP socket?

One host at a time: another one waits in the queue until the first has hung up.
"""

import select
import socket
from contextlib import suppress
from typing import final

READ = 1 << 16


@final
class TcpPort:
    """A listening socket; messages are lines."""

    def __init__(self, host: str = "127.0.0.1") -> None:
        """Listen on a free port of ``host``."""
        self._host, self._port = host, 0
        self._listener: socket.socket | None = None
        self._peer: socket.socket | None = None
        self._unsent, self._heard = bytearray(), b""
        self.plug()

    @property
    def where(self) -> str:
        """Return the VISA address."""
        return f"TCPIP::{self._host}::{self._port}::SOCKET"

    def hear(self) -> list[bytes]:
        """Return the lines that arrived."""
        self._accept()
        if self._peer is None:
            return []
        try:
            data = self._peer.recv(READ)
        except BlockingIOError:
            return []
        except OSError:
            data = b""
        if not data:
            self._hang_up()
            return []
        *lines, rest = (self._heard + data).split(b"\n")
        self._heard = rest
        return [line for line in lines if line.strip()]

    def say(self, data: bytes) -> None:
        """Send bytes; what the host does not take now is sent later."""
        self._unsent += data
        self._flush()

    def wait(self, seconds: float) -> None:
        """Sleep until the host speaks or connects."""
        self._flush()
        sockets = [each for each in (self._peer or self._listener,) if each is not None]
        select.select(sockets, [], [], seconds)

    def pull(self) -> None:
        """Hang up and let nobody connect."""
        self._hang_up()
        if self._listener is not None:
            self._listener.close()
            self._listener = None

    def plug(self) -> None:
        """Listen again, on the same port."""
        if self._listener is None:
            self._unsent, self._heard = bytearray(), b""
            self._listener = socket.create_server((self._host, self._port), backlog=4)
            self._listener.setblocking(False)
            self._port = self._listener.getsockname()[1]

    def close(self) -> None:
        """Be gone for good."""
        self.pull()

    def _accept(self) -> None:
        """Take the next host when there is none."""
        if self._peer is None and self._listener is not None:
            with suppress(BlockingIOError):
                self._peer = self._listener.accept()[0]
                self._peer.setblocking(False)
                self._peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._unsent, self._heard = bytearray(), b""

    def _flush(self) -> None:
        """Send what the host takes."""
        if self._peer is not None and self._unsent:
            with suppress(OSError):
                del self._unsent[:self._peer.send(self._unsent)]

    def _hang_up(self) -> None:
        if self._peer is not None:
            self._peer.close()
            self._peer = None
