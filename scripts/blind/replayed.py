"""A verdict's models on a log of the case: what blind_check and promise.py measure."""
import json, subprocess


def errors(build, jobs, experiment, log, verdict):
    """Errors on `log`, in windows, of the refitted base model and of the final one; None where a replay fails."""
    found = []
    for which in ("refit_model", "model"):
        model = verdict[which]
        command = [build / "bin/gapscope", "replay", experiment, log, "--mode", "windows", "--nuisances", "--json",
                   "--quiet", "--jobs", str(jobs)]
        for effect in model["effects"]:
            command += ["--with", f"{effect['name']}@{effect['on']}"]
        for name, value in model["values"].items():
            command += ["--set", f"{name}={value!r}"]
        result = subprocess.run(command, capture_output=True, text=True)
        found.append(json.loads(result.stdout)["error"] if result.returncode == 0 else None)
    return found
