import json


def test_devices_are_listed_whatever_is_there(run):
    code, out, said = run("devices", "--json")
    assert code == 0, said
    found = json.loads(out)
    assert set(found) == {"cameras", "microphones", "ports", "drives", "notes"}
    assert "serial (odrive)" in found["drives"]
    code, out, said = run("devices")
    assert (code, "serial (odrive)" in out) == (0, True), said
