"""A Slurm of one node in a folder of its own: munged, slurmctld and slurmd on free ports of this machine, ended with it."""
import ctypes
import os
import pathlib
import pwd
import shutil
import signal
import socket
import subprocess
import time

PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36
NEEDED = ("munged", "slurmctld", "slurmd", "sbatch", "scontrol", "scancel", "squeue")

CONFIGURATION = """\
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmdPort={node_port}
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CryptoType=crypto/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=task=1
JobAcctGatherParams=OverMemoryKill
AccountingStorageType=accounting_storage/none
SchedulerType=sched/backfill
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
KillWait=5
MinJobAge=600
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory_mb} State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def program(name):
    return shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/usr/local/sbin")


def missing():
    return [name for name in NEEDED if program(name) is None]


def free_ports(n):
    sockets = [socket.socket() for _ in range(n)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def ends_with_us():
    """In the child: the kernel ends it when the test is gone, whatever has ended that."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


class Slurm:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder).resolve()
        self.daemons = []
        for name in ("state", "spool"):
            (self.folder / name).mkdir(parents=True)
        self.folder.chmod(0o755)
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o600)
        controller_port, node_port = free_ports(2)
        self.configuration = self.folder / "slurm.conf"
        self.configuration.write_text(CONFIGURATION.format(
            host=socket.gethostname().split(".")[0], controller_port=controller_port, node_port=node_port,
            user=pwd.getpwuid(os.geteuid()).pw_name, folder=self.folder, cores=os.cpu_count(),
            memory_mb=os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") * 9 // 10 // 2**20))
        self.environment = {**os.environ, "SLURM_CONF": str(self.configuration)}

    def __enter__(self):
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1)
        try:
            self.start("munged", "--foreground", "--force", f"--socket={self.folder}/munge.socket",
                       f"--key-file={self.folder}/munge.key", f"--pid-file={self.folder}/munged.pid",
                       f"--log-file={self.folder}/munged.log", f"--seed-file={self.folder}/munge.seed")
            self.until((self.folder / "munge.socket").exists)
            self.start("slurmctld", "-D")
            self.start("slurmd", "-D")
            self.until(lambda: "State=IDLE" in self.ask("scontrol", "-o", "show", "node"))
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        """The jobs first, then who has started them."""
        try:
            subprocess.run(["scancel", "--quiet", "--me"], env=self.environment, timeout=30, capture_output=True)
            self.until(lambda: not self.ask("squeue", "--noheader"), limit=30)
        except (subprocess.TimeoutExpired, AssertionError):
            pass
        for daemon in reversed(self.daemons):
            daemon.terminate()
            try:
                daemon.wait(15)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()
        self.end_processes()

    def processes(self):
        """Of this Slurm: whatever has its configuration in its environment, jobs too."""
        mark, out = f"SLURM_CONF={self.configuration}".encode(), []
        for path in pathlib.Path("/proc").glob("[0-9]*/environ"):
            try:
                if mark in path.read_bytes().split(b"\0"):
                    out.append(int(path.parent.name))
            except OSError:  # it has ended, or is not ours
                pass
        return out

    def end_processes(self, limit=10):
        """The guardians of jobs stand alone, and fall to us when their own parent has ended."""
        for end_by in (signal.SIGTERM, signal.SIGKILL):
            for process in self.processes():
                os.kill(process, end_by)
            end = time.time() + limit
            while self.processes() and time.time() < end:
                time.sleep(0.05)
        try:
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        except ChildProcessError:
            pass

    def start(self, name, *words):
        with open(self.folder / f"{name}.out", "w") as out:
            self.daemons.append(subprocess.Popen([program(name), *words], env=self.environment, stdout=out, stderr=out,
                                                 stdin=subprocess.DEVNULL, preexec_fn=ends_with_us))

    def ask(self, *words):
        done = subprocess.run(words, env=self.environment, capture_output=True, text=True, timeout=60)
        return done.stdout.strip() if done.returncode == 0 else done.stderr

    def until(self, condition, limit=60):
        end = time.time() + limit
        while not condition():
            gone = [daemon.args[0] for daemon in self.daemons if daemon.poll() is not None]
            if gone or time.time() > end:
                logs = "".join(f"{log.name}: {log.read_text()[-1000:]}\n" for log in self.folder.glob("*.log"))
                raise AssertionError(f"{gone or 'not within'} {limit} s\n{logs}")
            time.sleep(0.1)
