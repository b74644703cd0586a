"""A Dask scheduler that somebody runs elsewhere, and how this program proves to it, and it to this program, who it is.

Whoever reaches a scheduler or a worker without TLS can run any command there as the user who started it: Dask sends
functions as pickles. Results come back as pickles, so that this process trusts its scheduler and workers as its own
code.
"""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from swashplate.errors import CampaignError
from swashplate.extras import library

_CA, _CERTIFICATE, _KEY = _OPTIONS = ("tls_ca_file", "tls_cert", "tls_key")
_HOW = "docs/howto/campaigns.md shows how to make the files and how to start both with TLS."


@dataclass(frozen=True)
class DaskScheduler:
    """Where a scheduler is, and the files with which it is talked to.

    Attributes:
        address: "tls://host:8786"; "tcp://host:8786" only with `insecure`.
        ca: certificate that has signed those of scheduler and workers (PEM). certificate, key: of this client, signed
            by the same (PEM). What is None is taken from Dask's configuration.
        insecure: take a scheduler without TLS. Every user who reaches its port can then run commands as its owner, as
            the owner of each worker, and as you.
    """

    address: str
    ca: str | Path | None = None
    certificate: str | Path | None = None
    key: str | Path | None = None
    insecure: bool = False

    def __str__(self) -> str:
        return self.address

    @property
    def place(self) -> tuple[str, int]:
        """Its host and port.

        Raises:
            CampaignError: where the address is none.
        """
        try:
            parts = urlsplit(self.address)
            host, port = parts.hostname, parts.port
        except ValueError:  # a port that is no number
            host = port = None
        if not host or not port or parts.scheme not in ("tcp", "tls"):
            raise CampaignError("is no address of a scheduler.", where=self.address, hint="Example: tls://host:8786")
        return host, port

    def security(self) -> Any:
        """What Dask's client is given (`distributed.Security`).

        Raises:
            CampaignError: without TLS, where that was not asked for; a file that is missing, that other users can
                read, or that is no certificate or key.
        """
        make = library("distributed", what="a campaign past one machine").Security
        self.place  # noqa: B018
        if not self.address.startswith("tls:"):
            return self._open(make)
        ca = self._file(_CA, self.ca, "ca-file")
        certificate = self._file(_CERTIFICATE, self.certificate, "client.cert")
        key = self._file(_KEY, self.key, "client.key")
        security = make(tls_ca_file=ca, tls_client_cert=certificate, tls_client_key=key, require_encryption=True)
        try:
            security.get_connection_args("client")
        except OSError as error:  # what OpenSSL says of a file is one
            raise CampaignError(
                f"are no certificates, and no key that belongs to one of them: {error.strerror}.",
                channel=", ".join(_OPTIONS),
                hint=_HOW,
            ) from None
        return security

    def _open(self, make: Any) -> Any:
        if any((self.ca, self.certificate, self.key)):
            raise CampaignError(
                "speaks without TLS, and files for TLS are given.",
                where=self.address,
                hint=f"Start it with --protocol tls, and say tls:// here. {_HOW}",
            )
        if not self.insecure:
            raise CampaignError(
                "speaks without TLS: every user of its machine, and everybody who reaches its port, can run commands "
                "as its owner, as the owner of each worker, and as you here.",
                where=self.address,
                hint=f"Start it with --protocol tls. {_HOW} If everybody who reaches it may do that: "
                "--settings insecure=true.",
            )
        return make(require_encryption=False)

    def _file(self, option: str, given: str | Path | None, entry: str) -> str:
        file = os.fspath(given or library("dask").config.get(f"distributed.comm.tls.{entry}", None) or "")
        if not file:
            raise CampaignError(
                "is missing, and Dask's configuration names none.",
                where=self.address,
                channel=option,
                hint=f"TLS needs all of {', '.join(_OPTIONS)}. {_HOW}",
            )
        if "\n" in file:  # Dask's configuration may hold the text itself
            return file
        try:
            status = os.stat(file)
        except OSError as error:
            raise CampaignError(f"cannot be read: {error.strerror}.", where=file, channel=option) from None
        if option == _KEY and status.st_mode & stat.S_IRWXO:
            raise CampaignError(
                "can be read by every user of this machine: whoever has it can run commands as you.",
                where=file,
                channel=option,
                hint="Make new files, and run `chmod 600` on the key before it is used.",
            )
        return file
