"""What is exported for a URDF: attributes of ros/urdfdom (urdf_parser/src/joint.cpp), read by MuJoCo's own parser."""

import shutil
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import gapscope as gs
import pytest

from conftest import ROOT, servo_log

ATTRIBUTES = {"limit": {"lower", "upper", "effort", "velocity"}, "dynamics": {"damping", "friction"}}
ROBOT = """<robot name="r"><mujoco><compiler discardvisual="true"/></mujoco>
<link name="base"/><link name="link"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0"
iyz="0"/></inertial></link>{}</robot>"""


def attributes(path: Path) -> dict[str, dict[str, float]]:
    """Of each element of a joint's patch."""
    joint = ElementTree.parse(path).getroot()
    assert joint.tag == "joint" and set(joint.attrib) == {"name", "type"}
    for element in joint:
        assert set(element.attrib) <= ATTRIBUTES[element.tag]
    return {element.tag: {key: float(value) for key, value in element.attrib.items()} for element in joint}


@pytest.fixture(scope="module")
def servo(tmp_path_factory: pytest.TempPathFactory) -> gs.Replay:
    log = servo_log(tmp_path_factory.mktemp("servo"), 500)
    values = {
        "coulomb_friction@joint.friction_n_m": 3.0,
        "torque_limit@motor.limit_n_m": 40.0,
        "backlash@joint.gap_rad": 0.02,
        "command_delay@motor.delay_s": 0.004,
    }
    effects = sorted({name.rpartition(".")[0] for name in values})
    return gs.replay(str(ROOT / "models" / "joint" / "experiment.yaml"), log, with_=effects, set=values)


def test_a_servo(servo: gs.Replay, tmp_path: Path) -> None:
    lost = servo.export("urdf", tmp_path / "to")
    forms = {e.name: e.form for e in lost.effects}
    assert forms == {
        "coulomb_friction": "exact",
        "torque_limit": "exact",
        "backlash": "dropped",
        "command_delay": "host",
    }
    assert sorted(path.name for path in (tmp_path / "to").iterdir()) == ["fidelity.json", "joint_joint.urdf"]
    made = attributes(tmp_path / "to" / "joint_joint.urdf")
    assert made == {"limit": {"effort": 40}, "dynamics": {"damping": 0.5, "friction": pytest.approx(3)}}


def test_mujoco_reads_the_joint(servo: gs.Replay, tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    servo.export("urdf", tmp_path / "to")
    joint = ElementTree.parse(tmp_path / "to" / "joint_joint.urdf").getroot()
    for tag, link in (("parent", "base"), ("child", "link")):
        ElementTree.SubElement(joint, tag, link=link)
    model = mujoco.MjModel.from_xml_string(ROBOT.format(ElementTree.tostring(joint, encoding="unicode")))
    assert (model.dof_damping[0], model.dof_frictionloss[0]) == (0.5, pytest.approx(3))
    assert model.jnt_actfrcrange[0].tolist() == [-40, 40]


def test_a_voltage_drive_and_a_joint_without_one(experiment: str, short: str, tmp_path: Path) -> None:
    """Stall torque and no-load speed at 24 V: kt U / R and U / km (models/qube/README.md)."""
    shutil.copytree(ROOT / "models", tmp_path / "models")
    mjcf = tmp_path / "models" / "qube" / "qube.xml"
    text = mjcf.read_text()
    mjcf.write_text(text.replace('name="motor" joint="arm"', 'name="motor" joint="arm" ctrlrange="-24 24"'))
    for bound, limited in ((experiment, False), (str(mjcf.with_name("experiment.yaml")), True)):
        result = gs.replay(bound, short)
        result.export("urdf", tmp_path / "to")
        arm = attributes(tmp_path / "to" / "joint_arm.urdf")
        assert arm["dynamics"] == {"damping": 1.5e-4}
        limit = {"effort": pytest.approx(0.042 * 24 / 8.4), "velocity": pytest.approx(24 / 0.042)}
        assert arm.get("limit") == (limit if limited else None)
        assert attributes(tmp_path / "to" / "joint_pendulum.urdf") == {"dynamics": {"damping": 3e-5}}
    with pytest.raises(gs.InputError, match="--draws"):
        result.export("urdf", tmp_path / "to", draws=3)
