"""What a result was made with."""

import subprocess

import aidsr
from aidsr.core.provenance import commit, processor, versions_of


def test_a_commit_is_that_of_the_checkout_and_says_that_sources_differ(tmp_path):
    def git(*words):
        subprocess.run(["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b", *words], check=True)

    git("init", "-q")
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "module.py").write_text("1")
    (tmp_path / "results.md").write_text("1")
    git("add", ".")
    git("commit", "-qm", "first")
    clean = commit.__wrapped__(tmp_path)
    assert len(clean) == 12
    (tmp_path / "results.md").write_text("2")
    assert commit.__wrapped__(tmp_path) == clean
    (tmp_path / "src" / "module.py").write_text("2")
    assert commit.__wrapped__(tmp_path) == f"{clean}-dirty"


def test_without_a_checkout_the_version_stands_for_the_commit(tmp_path):
    assert commit(tmp_path) == aidsr.__version__


def test_a_processor_has_a_name_and_what_is_not_installed_no_version():
    assert processor()
    assert versions_of(["mujoco", "no-such-package"]).keys() == {"python", "mujoco"}
