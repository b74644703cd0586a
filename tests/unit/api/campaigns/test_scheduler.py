"""A scheduler is talked to with TLS, or its user has said that it may be without; nobody else gets in."""

from __future__ import annotations

import os
import pwd
import shutil
import stat
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import made_campaigns
from dask_cluster import Cluster, certificates, cluster
from swashplate.api.campaigns.dask_engine import DaskEngine
from swashplate.api.campaigns.scheduler import DaskScheduler
from swashplate.errors import CampaignError


@pytest.fixture(scope="module")
def dask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """A scheduler with TLS, and one worker."""
    with cluster(tmp_path_factory.mktemp("tls")) as made:
        yield made


@pytest.fixture(scope="module")
def others(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A certificate that the cluster knows nothing of, and its key."""
    return certificates(tmp_path_factory.mktemp("others"))


def test_one_without_tls_is_refused_in_words_until_that_is_asked_for() -> None:
    with pytest.raises(CampaignError) as refused:
        DaskScheduler("tcp://host:8786").security()
    for words in ("can run commands as its owner", "as you here", "--protocol tls", "insecure=true"):
        assert words in str(refused.value)
    assert DaskScheduler("tcp://host:8786", insecure=True).security().require_encryption is False
    assert DaskScheduler("tcp://host:8786", insecure=True).place == ("host", 8786)


@pytest.mark.parametrize(
    "address", ["nonsense://x", "tcp://host", "tls://host:port", "host:8786", "ws://host:8786", ""]
)
def test_what_is_no_address_is_refused(address: str) -> None:
    with pytest.raises(CampaignError, match="is no address of a scheduler"):
        DaskScheduler(address, insecure=True).security()


def test_files_that_are_missing_open_to_all_or_none_are_named(others: tuple[Path, Path], tmp_path: Path) -> None:
    certificate, key = others
    named = DaskScheduler("tls://host:8786", ca=certificate, certificate=certificate, key=key)
    assert named.security().require_encryption is True
    assert stat.S_IMODE(key.stat().st_mode) == 0o600, "openssl makes it so; the docs count on it"

    def refused(told: str, **files: Path | None) -> None:
        given = {"ca": certificate, "certificate": certificate, "key": key, **files}
        with pytest.raises(CampaignError, match=told):
            DaskScheduler("tls://host:8786", **given).security()  # type: ignore[arg-type]

    for name, option in (("ca", "tls_ca_file"), ("certificate", "tls_cert"), ("key", "tls_key")):
        refused(f"{option}: is missing, and Dask's configuration names none", **{name: None})
        refused(f"none.pem: {option}: cannot be read: No such file", **{name: tmp_path / "none.pem"})
    refused("tls_key: can be read by every user of this machine", key=certificate)
    (tmp_path / "text.pem").touch(0o600)
    refused("are no certificates, and no key that belongs", key=tmp_path / "text.pem")
    refused("are no certificates, and no key that belongs", ca=tmp_path / "text.pem")
    with pytest.raises(CampaignError, match="speaks without TLS, and files for TLS are given"):
        DaskScheduler("tcp://host:8786", ca=certificate, insecure=True).security()


def test_files_of_dasks_configuration_are_taken(others: tuple[Path, Path]) -> None:
    from dask import config

    certificate, key = others
    own = {"cert": str(certificate), "key": str(key)}
    with config.set({"distributed.comm.tls.ca-file": str(certificate), "distributed.comm.tls.client": own}):
        assert DaskScheduler("tls://host:8786").security().tls_client_key == str(key)


KNOCKS = """
import sys
from distributed import Client, Security
address, *files = sys.argv[1:]
ca, certificate, key = [*files, None, None, None][:3]
security = Security(tls_ca_file=ca, tls_client_cert=certificate, tls_client_key=key) if files else None
try:
    with Client(address, security=security, timeout="20s") as client:
        print("RAN", client.run_on_scheduler(lambda: 1 + 1), client.run(lambda: 1 + 1))
except Exception as error:
    print("REFUSED", type(error).__name__)
"""


def _knocked(*words: str, user: str | None = None) -> str:
    """What a client of Dask says that somebody starts: this user, or another one of this machine."""
    here = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path), "HOME": "/"}
    command = [sys.executable, "-c", KNOCKS, *words]
    if user is not None:
        theirs = pwd.getpwnam(user)
        command = ["setpriv", f"--reuid={theirs.pw_uid}", f"--regid={theirs.pw_gid}", "--clear-groups", *command]
    ended = subprocess.run(command, env=here, cwd="/", capture_output=True, text=True, check=False, timeout=300)
    return ended.stdout.strip() or ended.stderr


def test_who_has_the_certificates_works_and_who_has_not_does_not(dask: Cluster, others: tuple[Path, Path]) -> None:
    assert _knocked(dask.address, str(dask.certificate), str(dask.certificate), str(dask.key)).startswith("RAN")
    certificate, key = others
    theirs = str(dask.certificate)  # is no secret: whoever connects is shown it
    for address in (dask.address, dask.address.replace("tls:", "tcp:")):
        assert _knocked(address).startswith("REFUSED")
        assert _knocked(address, theirs, str(certificate), str(key)).startswith("REFUSED")
    with pytest.raises(CampaignError, match=r"no worker answers: .*with TLS, all three need certificates"):
        DaskEngine(
            made_campaigns.numbers,
            scheduler=DaskScheduler(dask.address, ca=theirs, certificate=certificate, key=key),
        )
    with pytest.raises(CampaignError, match=r"no worker answers: .*certificate does not match"):
        DaskEngine(
            made_campaigns.numbers,
            scheduler=DaskScheduler(dask.address, ca=certificate, certificate=certificate, key=key),
        )


def test_another_user_of_the_machine_gets_in_without_tls_only(dask: Cluster) -> None:
    if os.geteuid() != 0 or shutil.which("setpriv") is None:
        pytest.skip("only root can be another user here (setpriv)")
    with cluster(None) as open_to_all:
        if not (told := _knocked(open_to_all.address, user="nobody")).startswith("RAN"):
            pytest.skip(f"the user nobody cannot run this Python: {told[-200:]}")
    assert _knocked(dask.address, user="nobody").startswith("REFUSED")
    theirs, key = str(dask.certificate), str(dask.key)
    assert _knocked(dask.address, theirs, theirs, key, user="nobody").startswith("REFUSED"), "the key is not theirs"
