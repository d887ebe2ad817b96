#!/usr/bin/env python3
"""snakemake --cluster-status: asks the controller, which knows a job for MinJobAge seconds after its end; then the accounts."""
import re
import subprocess
import sys

GOES_ON = ("PENDING", "CONFIGURING", "RUNNING", "COMPLETING", "SUSPENDED", "REQUEUED", "RESIZING", "SIGNALING", "STAGE_OUT")


def asked(*words):
    return subprocess.run(words, capture_output=True, text=True)


job = sys.argv[1]
answer = asked("scontrol", "-o", "show", "job", job)
if answer.returncode != 0 and "Invalid job id" not in answer.stderr:
    print("running")  # the controller does not answer: no reason to give the job up
    sys.exit()
found = re.search(r"JobState=(\w+)", answer.stdout) or re.search(r"(\w+)", asked("sacct", "-nXP", "-o", "State", "-j", job).stdout)
state = found[1] if found else "UNKNOWN"
print("success" if state == "COMPLETED" else "running" if state in GOES_ON else "failed")
