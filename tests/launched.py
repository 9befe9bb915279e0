"""The command line in a process of its own, without the seconds that its imports take.

A server imports what a command needs, does nothing else, and forks for each. The command is a
process as any other: signals, groups, streams and the exit code are its own.
"""

import importlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

SIZE = 1 << 20


class Server:
    """A process that forks."""

    def __init__(self):
        self.connection, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        with theirs:
            command = [sys.executable, __file__, str(theirs.fileno())]
            pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}  # as theirs will be
            self.process = subprocess.Popen(command, pass_fds=[theirs.fileno()], **pipes)

    def ask(self, question, fds=()):
        socket.send_fds(self.connection, [json.dumps(question).encode()], list(fds))
        return json.loads(self.connection.recv(SIZE))

    def close(self):
        self.connection.close()
        self.process.communicate(timeout=60)


class Launched:
    """A process that a server has forked, as far as `subprocess.Popen` would say it."""

    def __init__(self, server, arguments, imports=(), **how):
        self._server, self.returncode = server, None
        pipes = [os.pipe(), os.pipe()]
        self.stdout, self.stderr = (os.fdopen(read, encoding="utf-8") for read, _ in pipes)
        asked = {"argv": list(map(str, arguments)), "imports": imports, **how}
        self.pid = server.ask(asked, [write for _, write in pipes])
        for _, write in pipes:
            os.close(write)

    def send_signal(self, number):
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self):
        self.send_signal(signal.SIGKILL)

    def terminate(self):
        self.send_signal(signal.SIGTERM)

    def poll(self):
        if self.returncode is None:
            self.returncode = self._server.ask({"poll": self.pid})
        return self.returncode

    def wait(self, timeout=60):
        until = time.monotonic() + timeout
        while self.poll() is None:
            if time.monotonic() > until:
                raise subprocess.TimeoutExpired("afferents", timeout)
            time.sleep(0.01)
        return self.returncode

    def communicate(self, timeout=60):
        """Read all that it says; return it when the process has ended."""
        with ThreadPoolExecutor(2) as pool:
            said = [pool.submit(stream.read) for stream in (self.stdout, self.stderr)]
            self.wait(timeout)
            return tuple(one.result(timeout) for one in said)


def serve(connection):
    """Fork for who asks; return in the process that is to run a command."""
    while True:
        question, fds, *_ = socket.recv_fds(connection, SIZE, 2)
        if not question:
            sys.exit()
        asked = json.loads(question)
        if "poll" in asked:
            pid, status = os.waitpid(asked["poll"], os.WNOHANG)
            answer = os.waitstatus_to_exitcode(status) if pid else None
        else:
            for name in asked["imports"]:
                importlib.import_module(name)
            answer = os.fork()
            if answer == 0:
                connection.close()
                return asked, fds
            for fd in fds:
                os.close(fd)
        connection.send(json.dumps(answer).encode())


def become(asked, fds):
    for fd, number in zip(fds, (1, 2), strict=True):
        os.dup2(fd, number)
        os.close(fd)
    if asked.get("session"):
        os.setsid()
    if asked.get("files"):
        import resource  # not on Windows, where nothing is launched

        resource.setrlimit(resource.RLIMIT_NOFILE, (asked["files"],) * 2)
    if asked.get("cwd"):
        os.chdir(asked["cwd"])
    sys.argv = ["afferents", *asked["argv"]]


if __name__ == "__main__":
    sys.path.pop(0)  # this folder
    become(*serve(socket.socket(fileno=int(sys.argv[1]))))
    from afferents.__main__ import main

    main()
