"""Encrypted connections and tokens with roles, over certificates that are made here and kept nowhere."""

import asyncio
import contextlib
import json
import pathlib
import subprocess

import pytest
from conftest import BOX

import heliograph as hg
from heliograph import aio
from heliograph.tls import read_tls


class Authority:
    """A certificate authority in a folder, by the command openssl."""

    def __init__(self, folder: pathlib.Path, name: str) -> None:
        self.folder, self.name = folder, name
        folder.mkdir(exist_ok=True)
        self.ca = folder / f"{name}-ca.pem"
        self.key = folder / f"{name}-ca.key"
        self.run(
            *("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", 30),
            *("-keyout", self.key, "-out", self.ca, "-subj", f"/CN={name}"),
        )

    @staticmethod
    def run(*arguments: object) -> None:
        subprocess.run(["openssl", *map(str, arguments)], check=True, capture_output=True, timeout=60)

    def issue(self, name: str, names: str = "DNS:localhost,IP:127.0.0.1", days: int = 30) -> tuple[str, str]:
        """Certificate and key. days: of validity; negative: over."""
        key, wish, out = (self.folder / f"{name}{end}" for end in (".key", ".csr", ".pem"))
        extra = self.folder / f"{name}.ext"
        extra.write_text(f"basicConstraints=CA:FALSE\nsubjectAltName={names}\n")
        self.run(
            *("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"),
            *("-keyout", key, "-out", wish, "-subj", f"/CN={name}"),
        )
        self.run(
            *("x509", "-req", "-in", wish, "-CA", self.ca, "-CAkey", self.key, "-CAcreateserial"),
            *("-days", days, "-extfile", extra, "-out", out),
        )
        return str(out), str(key)


@pytest.fixture(scope="module")
def authority(tmp_path_factory):
    return Authority(tmp_path_factory.mktemp("authority"), "authority")


@contextlib.contextmanager
def daemon(program, certificate, *arguments):
    """The address of one that speaks TLS."""
    process = subprocess.Popen(
        [program, "--json", "--state", "none", "--log-level", "off", "--tls-certificate", certificate[0]]
        + ["--tls-key", certificate[1], *map(str, arguments)],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        told = json.loads(process.stdout.readline())
        assert told["tls"] is True
        yield told["listening"]
    finally:
        process.terminate()
        process.wait(30)
        process.stdout.close()


@pytest.fixture(scope="module")
def address(program, authority):
    with daemon(program, authority.issue("daemon")) as address:
        yield address


def test_a_trusted_daemon_renders(address, authority):
    with hg.connect(address, ca=authority.ca) as client:
        image = client.render(BOX, size=(16, 16), until=hg.Samples(1))
        assert image.shape == (16, 16)
        with client.session(BOX, size=(16, 16), until=hg.Samples(1)) as session:
            assert session.wait(samples=1).stats.samples == 1

    async def work():
        async with await aio.connect(address, ca=str(authority.ca)) as client:
            return (await client.render(BOX, size=(16, 16), until=hg.Samples(1))).shape

    assert asyncio.run(work()) == (16, 16)


def test_variables_name_the_files(address, authority, monkeypatch):
    monkeypatch.setenv("HELIOGRAPH_TLS_CA", str(authority.ca))
    with hg.connect(address) as client:
        assert client.info().threads >= 1
    with pytest.raises(hg.Unavailable, match="it speaks TLS"):
        hg.connect(address, tls=False)
    monkeypatch.setenv("HELIOGRAPH_TLS", "perhaps")
    with pytest.raises(hg.InvalidArgument, match="HELIOGRAPH_TLS: perhaps; allowed: on, off"):
        hg.connect(address)


def test_a_daemon_of_ones_own_is_reached_whatever_variables_say(program, authority, monkeypatch):
    certificate, key = authority.issue("operator")
    monkeypatch.setenv("HELIOGRAPH_TLS_CA", str(authority.ca))
    monkeypatch.setenv("HELIOGRAPH_TLS_CERTIFICATE", certificate)
    monkeypatch.setenv("HELIOGRAPH_TLS_KEY", key)
    with hg.serve(program, threads=1) as client:
        assert client.info().threads == 1


def test_errors_say_what_to_give(address, authority, tmp_path):
    wrong = Authority(tmp_path, "wrong")
    with pytest.raises(hg.Unavailable, match=r"it speaks TLS: connect with tls=True, .* ca=FILE"):
        hg.connect(address)
    with pytest.raises(hg.Unavailable, match=r"comes from no authority that this machine trusts .*ca=FILE"):
        hg.connect(address, tls=True)
    with pytest.raises(hg.Unavailable, match=rf"comes from no authority in '{wrong.ca}' .*ca=FILE"):
        hg.connect(address, ca=wrong.ca)
    with pytest.raises(hg.Unavailable, match="comes from no authority in"):
        asyncio.run(aio.connect(address, ca=wrong.ca))


def test_expired_and_misnamed_certificates(program, authority):
    with daemon(program, authority.issue("expired", days=-1)) as address:
        with pytest.raises(hg.Unavailable, match=r"not valid now \(certificate has expired\)"):
            hg.connect(address, ca=authority.ca)
    with daemon(program, authority.issue("named", "DNS:render.example")) as address:
        with pytest.raises(hg.Unavailable, match=r"for another name .*tls_name="):
            hg.connect(address, ca=authority.ca)
        with hg.connect(address, ca=authority.ca, tls_name="render.example") as client:
            assert client.info().threads >= 1


def test_a_certificate_of_ones_own(program, authority, tmp_path):
    callers, strangers = Authority(tmp_path, "callers"), Authority(tmp_path, "strangers")
    with daemon(program, authority.issue("asking"), "--tls-client-ca", callers.ca) as address:
        certificate, key = callers.issue("alice")
        with hg.connect(address, ca=authority.ca, certificate=certificate, key=key) as client:
            assert client.info().threads >= 1
        with pytest.raises(hg.Unavailable, match="certificate=FILE, key=FILE"):
            hg.connect(address, ca=authority.ca)
        certificate, key = strangers.issue("mallory")
        with pytest.raises(hg.Unavailable, match="does not accept the certificate in '.*mallory.pem'"):
            hg.connect(address, ca=authority.ca, certificate=certificate, key=key)


def test_a_plain_daemon(client, authority):
    with pytest.raises(hg.Unavailable, match="does not speak TLS"):
        hg.connect(client.address, token=client.daemon.token, ca=authority.ca)


def test_wrong_arguments(authority, tmp_path):
    certificate, key = authority.issue("one")
    _, other = authority.issue("two")
    (tmp_path / "text").write_text("no PEM")
    assert read_tls() is None and read_tls(tls=False) is None
    for arguments, field in (
        ({"ca": tmp_path / "missing"}, "ca"),
        ({"ca": tmp_path / "text"}, "ca"),
        ({"certificate": certificate}, "key"),
        ({"key": key}, "certificate"),
        ({"certificate": certificate, "key": other}, "key"),
        ({"tls": "yes"}, "tls"),
        ({"tls": False, "ca": authority.ca}, "tls"),
    ):
        with pytest.raises(hg.InvalidArgument) as told:
            hg.connect("127.0.0.1:1", **arguments)
        assert told.value.field == field, arguments
    with pytest.raises(hg.Unavailable, match="no daemon answers"):
        hg.connect("127.0.0.1:1", ca=authority.ca)


def test_roles(program, authority, heliograph, tmp_path):
    lines = ""
    for name, role in (("alice", "render"), ("eve", "view")):
        lines += heliograph("token", name, "--role", role, "--output", tmp_path / name)
    (tmp_path / "tokens").write_text(lines)
    with daemon(program, authority.issue("roles"), "--token-file", tmp_path / "tokens") as address:
        with hg.connect(address, ca=authority.ca, token_file=tmp_path / "eve") as eve:
            assert eve.scenes() == []
            with pytest.raises(hg.PermissionDenied, match="'eve' has the role view; LoadScene needs render"):
                eve.load(BOX)
            with hg.connect(address, ca=authority.ca, token_file=tmp_path / "alice") as alice:
                scene = alice.load(BOX)
                assert [other.id for other in eve.scenes()] == [scene.id]
        with pytest.raises(hg.PermissionDenied, match="wants a token"):
            hg.connect(address, ca=authority.ca)
        with pytest.raises(hg.InvalidArgument, match="what a daemon knows of one"):
            hg.connect(address, ca=authority.ca, token_file=tmp_path / "tokens")
