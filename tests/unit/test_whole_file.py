"""Output files: whole or not at all; devices, pipes and links keep what they are."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from pretravel.base.errors import PretravelError
from pretravel.base.whole_files import temporary_folder, whole_file, write_text, write_texts
from pretravel.cli.files import check_files

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="devices and locks of Unix")


class TestWhatIsNoFile:
    def test_a_device_is_written_to_and_not_replaced(self, tmp_path: Path) -> None:
        device = Path("/dev/null")
        if os.geteuid() == 0:  # who could really replace it
            device = tmp_path / "null.csv"
            os.mknod(device, stat.S_IFCHR | 0o666, os.makedev(1, 3))
        write_text(device, "nothing")
        assert stat.S_ISCHR(device.stat().st_mode)
        assert len(list(tmp_path.iterdir())) <= 1

    def test_a_pipe_carries_the_content(self, tmp_path: Path) -> None:
        pipe = tmp_path / "pipe.csv"
        os.mkfifo(pipe)
        received: list[str] = []
        reader = threading.Thread(target=lambda: received.append(pipe.read_text()), daemon=True)
        reader.start()
        write_text(pipe, "through the pipe")
        if not stat.S_ISFIFO(pipe.lstat().st_mode):  # replaced: let the reader end
            reader.join(0.1)
        else:
            reader.join(10.0)
        assert received == ["through the pipe"]
        assert stat.S_ISFIFO(pipe.stat().st_mode)

    @pytest.mark.parametrize("there", [True, False])
    def test_a_link_stays_and_its_file_is_replaced(self, tmp_path: Path, there: bool) -> None:
        (tmp_path / "real").mkdir()
        real, link = tmp_path / "real" / "map.csv", tmp_path / "link.csv"
        if there:
            real.write_text("old")
        link.symlink_to(real)
        write_text(link, "new")
        assert link.is_symlink()
        assert real.read_text() == "new"
        assert list((tmp_path / "real").iterdir()) == [real]

    @pytest.mark.parametrize("name", ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"])
    def test_standard_output_is_a_pipe_or_a_file(self, tmp_path: Path, name: str) -> None:
        code = (
            "from pretravel.base.whole_files import write_text\n"
            f"print('before'); write_text({name!r}, 'content\\n'); print('after')"
        )
        command = [sys.executable, "-c", code]
        piped = subprocess.run(command, capture_output=True, text=True, check=True)
        assert piped.stdout == "before\ncontent\nafter\n"
        with (tmp_path / "out.txt").open("w") as file:
            subprocess.run(command, stdout=file, check=True)
        assert (tmp_path / "out.txt").read_text() == "before\ncontent\nafter\n"

    def test_a_stream_needs_no_ending_where_there_is_one_format(self) -> None:
        check_files([(Path("/dev/null"), (".csv",)), (Path("/dev/stdout"), (".csv",))])
        with pytest.raises(PretravelError, match="no ending, which decides the format"):
            check_files([(Path("/dev/null"), (".csv", ".nc"))])


class TestPermissions:
    def test_the_old_permissions_are_kept(self, tmp_path: Path) -> None:
        file = tmp_path / "private.csv"
        file.write_text("old")
        file.chmod(0o600)
        write_text(file, "new")
        assert stat.S_IMODE(file.stat().st_mode) == 0o600

    def test_the_group_of_a_shared_file_is_kept(self, tmp_path: Path) -> None:
        """Else its members lose access to a file with the permissions 660."""
        mine = os.getgid()
        groups = [65534] if os.geteuid() == 0 else [g for g in os.getgroups() if g != mine]
        if not groups:
            pytest.skip("this user is in one group only")
        file = tmp_path / "shared.csv"
        file.write_text("old")
        os.chown(file, -1, groups[0])
        file.chmod(0o660)
        write_text(file, "new")
        found = file.stat()
        assert (found.st_gid, stat.S_IMODE(found.st_mode)) == (groups[0], 0o660)

    @pytest.mark.skipif(os.geteuid() != 0, reason="only the administrator gives files to others")
    def test_the_administrator_leaves_a_file_to_its_owner(self, tmp_path: Path) -> None:
        file = tmp_path / "of_a_user.csv"
        file.write_text("old")
        os.chown(file, 65534, 65534)
        write_text(file, "new")
        assert (file.stat().st_uid, file.stat().st_gid) == (65534, 65534)

    @pytest.mark.skipif(os.geteuid() == 0, reason="nothing is protected from the administrator")
    def test_a_protected_file_is_not_replaced(self, tmp_path: Path) -> None:
        file = tmp_path / "kept.csv"
        file.write_text("old")
        file.chmod(0o400)
        with pytest.raises(PretravelError, match="write-protected"):
            write_text(file, "new")
        assert file.read_text() == "old"


def _killed_writer(target: Path) -> None:
    """Kill a process while it writes a file and has a temporary folder."""
    code = (
        "import sys, time\n"
        "from pretravel.base.whole_files import temporary_folder, whole_file\n"
        f"with whole_file({str(target)!r}) as file, temporary_folder() as folder:\n"
        "    file.write_text('half'); (folder / 'a').write_text('a')\n"
        "    print('there', flush=True); time.sleep(60)"
    )
    environment = os.environ | {"TMPDIR": str(target.parent)}
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, env=environment
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(signal.SIGKILL)


class TestKilledRuns:
    def test_the_next_run_removes_what_they_left(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        target = tmp_path / "map.csv"
        target.write_text("old")
        _killed_writer(target)
        assert target.read_text() == "old"
        assert len(list(tmp_path.iterdir())) == 3  # the old file, and what the killed run left
        write_text(target, "new")
        assert [file.name for file in tmp_path.iterdir()] == ["map.csv"]
        _killed_writer(target)
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
        with temporary_folder() as folder:
            assert sorted(file.name for file in tmp_path.iterdir()) == [folder.name, "map.csv"]

    def test_a_writer_at_work_keeps_its_file(self, tmp_path: Path) -> None:
        with whole_file(tmp_path / "a.csv") as first:
            first.write_text("first")
            with whole_file(tmp_path / "a.csv") as second:
                second.write_text("second")
            assert (tmp_path / "a.csv").read_text() == "second"
        assert (tmp_path / "a.csv").read_text() == "first"

    @pytest.mark.long
    def test_many_writers_at_once_lose_nothing(self, tmp_path: Path) -> None:
        code = (
            "import sys\nfrom pretravel.base.whole_files import write_text\n"
            "for n in range(100):\n    write_text(sys.argv[1], f'{n} ' * 50)"
        )
        writers = [
            subprocess.Popen([sys.executable, "-c", code, str(tmp_path / f"{n % 2}.csv")])
            for n in range(4)
        ]
        assert [writer.wait(60) for writer in writers] == [0] * 4
        assert sorted(file.name for file in tmp_path.iterdir()) == ["0.csv", "1.csv"]
        assert (tmp_path / "0.csv").read_text() == "99 " * 50

    def test_files_of_others_are_kept(self, tmp_path: Path) -> None:
        for name in (".pretravel-settings", ".map-abcdefgh.csv"):
            (tmp_path / name).write_text("mine")
        write_text(tmp_path / "map.csv", "new")
        assert len(list(tmp_path.iterdir())) == 3


class TestSeveralFiles:
    def test_all_or_none(self, tmp_path: Path) -> None:
        folder = tmp_path / "programs"
        write_texts(folder, {"a.ngc": "old", "b.ngc": "old"}, "ascii")
        with pytest.raises(UnicodeEncodeError):
            write_texts(folder, {"a.ngc": "new", "b.ngc": "µ"}, "ascii")
        assert [(folder / name).read_text() for name in ("a.ngc", "b.ngc")] == ["old", "old"]
        assert len(list(folder.iterdir())) == 2

    def test_no_empty_folder_is_left(self, tmp_path: Path) -> None:
        with pytest.raises(UnicodeEncodeError):
            write_texts(tmp_path / "programs", {"b.ngc": "µ"}, "ascii")
        assert list(tmp_path.iterdir()) == []

    def test_a_file_within_a_file(self, tmp_path: Path) -> None:
        with whole_file(tmp_path / "a.csv") as outer:
            write_text(outer, "inner")
            assert len(list(tmp_path.iterdir())) == 1
        assert (tmp_path / "a.csv").read_text() == "inner"


@pytest.mark.skipif(sys.platform == "win32", reason="links and owners")
class TestFolderOfOthers:
    def test_a_link_in_the_place_of_the_file_changes_nothing_elsewhere(
        self, tmp_path: Path
    ) -> None:
        """In a folder that others can write to, the name can be a link at any moment."""
        folder, elsewhere = tmp_path / "shared", tmp_path / "private.csv"
        folder.mkdir()
        folder.chmod(0o777)
        elsewhere.write_text("mine")
        elsewhere.chmod(0o600)
        with whole_file(folder / "a.csv") as temporary:
            for each in folder.iterdir():  # nothing is written there by its name
                each.unlink()
                each.symlink_to(elsewhere)
            temporary.write_text("whole")
        assert (folder / "a.csv").read_text() == "whole"
        assert not (folder / "a.csv").is_symlink()
        assert elsewhere.read_text() == "mine"
        assert elsewhere.stat().st_mode & 0o777 == 0o600

    def test_the_mode_is_set_through_what_was_opened(self, tmp_path: Path) -> None:
        elsewhere = tmp_path / "private.csv"
        elsewhere.write_text("mine")
        elsewhere.chmod(0o600)

        def write() -> None:
            with whole_file(tmp_path / "a.csv") as temporary:
                temporary.write_text("whole")
                temporary.unlink()
                temporary.symlink_to(elsewhere)

        with pytest.raises(PretravelError, match="cannot write"):
            write()
        assert elsewhere.stat().st_mode & 0o777 == 0o600
        assert not (tmp_path / "a.csv").exists()
