"""A kernel of Jupyter whose cell tunes is interrupted, and goes on. Prints what its cells printed; run by
test_notebooks.py with the interpreter of the notebooks, which has jupyter_client."""

from jupyter_client.blocking import BlockingKernelClient
from jupyter_client.manager import start_new_kernel

TUNE = """
import gapscope as gs
told = []
def progress(state):
    if not told:
        print("under way", flush=True)
    told.append(state)
try:
    gs.tune("models/qube/experiment.yaml", "demo/qube.csv", with_=["coulomb_friction@arm"], progress=progress)
    print("ended")
except gs.Interrupted as stopped:
    print("partial" if stopped.partial.error.train > 0 else "nothing")
"""


def printed(client: BlockingKernelClient, cell: str, until: str = "") -> str:
    """What the cell prints to its end, or up to a text."""
    text = ""
    while True:
        message = client.get_iopub_msg(timeout=120)
        if message["parent_header"].get("msg_id") != cell:
            continue
        content = message["content"]
        text += content.get("text", "") + content.get("ename", "")
        ended = message["msg_type"] == "status" and content["execution_state"] == "idle"
        if ended or (until and until in text):
            return text


manager, client = start_new_kernel(kernel_name="python3")
try:
    cell = client.execute(TUNE)
    print(printed(client, cell, until="under way").strip())
    manager.interrupt_kernel()
    print(printed(client, cell).strip())
    print(printed(client, client.execute("print(1 + 1)")).strip())
finally:
    client.stop_channels()
    manager.shutdown_kernel(now=True)
