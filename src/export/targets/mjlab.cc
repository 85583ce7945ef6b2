// mjlab 1.6, on MuJoCo Warp 3.11: the MJCF as an entity, its drives as XmlActuatorCfg, which delays in steps.
// Sources: the wheels mjlab 1.6.0 (actuator/actuator.py, actuator/xml_actuator.py, entity/entity.py, sim/sim.py,
// envs/mdp/dr) and mujoco_warp 3.11.0 (_src/types.py: the arrays that a world has of its own).
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <map>
#include <set>

#include "src/core/collect.h"
#include "src/export/drive_laws.h"
#include "src/export/mjlab_laws.h"
#include "src/export/python_text.h"
#include "src/export/target.h"
#include "src/model/element_names.h"

namespace gapscope {
namespace {

// A term of mjlab that draws one number of a joint.
struct DrTerm {
  const char *field, *function;
};
constexpr DrTerm kDrTerms[] = {{"dof_damping", "joint_damping"},
                               {"dof_frictionloss", "joint_friction"},
                               {"dof_armature", "joint_armature"},
                               {"jnt_stiffness", "joint_stiffness"}};

// Arrays that each environment may have of its own, by the start of their names, and what their rows are.
struct RowKind {
  const char *prefix, *kind;
  mjtObj object;
};
constexpr RowKind kRowKinds[] = {{"body_", "body", mjOBJ_BODY},
                                 {"jnt_", "joint", mjOBJ_JOINT},
                                 {"dof_", "dof", mjOBJ_JOINT},
                                 {"qpos", "qpos", mjOBJ_JOINT},
                                 {"actuator_", "actuator", mjOBJ_ACTUATOR},
                                 {"tendon_", "tendon", mjOBJ_TENDON}};

const RowKind* KindOf(const std::string& field) {
  const auto found =
      std::ranges::find_if(kRowKinds, [&](const RowKind& kind) { return field.starts_with(kind.prefix); });
  return found == std::end(kRowKinds) ? nullptr : found;
}

// The name of a row's element; empty: it has none, or is a part of a joint of several angles.
std::string NameOfRow(const mjModel& model, const RowKind& kind, std::size_t row) {
  int id = static_cast<int>(row);
  if (std::string_view(kind.kind) == "dof") id = model.dof_jntid[row];
  if (std::string_view(kind.kind) == "qpos")
    id = static_cast<int>(std::ranges::count_if(std::span(model.jnt_qposadr, static_cast<std::size_t>(model.njnt)),
                                                [&](int start) { return start <= static_cast<int>(row); })) -
         1;
  if (kind.object == mjOBJ_JOINT && model.jnt_type[id] != mjJNT_HINGE && model.jnt_type[id] != mjJNT_SLIDE) return "";
  return NameOf(model, kind.object, id);
}

// An actuator that mjlab drives: the first one of its joint.
struct Drive {
  std::string name, joint, field;  // field: of mjlab's command
};

class MjlabWriter {
 public:
  explicit MjlabWriter(const TargetInput& input) : input_(input), compiled_(*input.exported.compiled) { FindDrives(); }

  Status Check() const;
  std::string Text() const;

 private:
  void FindDrives();
  std::string Simulation() const;
  std::string Actuators() const;
  std::string Lags(const Drive& drive) const;
  std::string Robot() const;
  std::string Ranges() const;
  std::string Drawn(std::set<std::string>* fields) const;
  std::string DrawnLags() const;
  std::string Draws() const;
  const std::vector<ParameterRange>& ranges() const { return input_.randomization->ranges; }
  int DelayRow(const std::string& drive) const;
  bool HasLaw(const std::string& drive) const { return input_.exported.laws.contains(drive); }

  const TargetInput& input_;
  const mjModel& compiled_;
  std::vector<Drive> drives_;
  std::vector<std::string> idle_;  // actuators that mjlab sends nothing
};

void MjlabWriter::FindDrives() {
  std::set<std::string> joints;
  for (int a = 0; a < compiled_.nactuator; ++a) {
    const std::string name = NameOf(compiled_, mjOBJ_ACTUATOR, a);
    if (mj_name2id(&input_.model.compiled(), mjOBJ_ACTUATOR, name.c_str()) < 0) continue;  // ours, without a command
    const bool joint = compiled_.actuator_trntype[a] == mjTRN_JOINT;
    const std::string on = joint ? NameOf(compiled_, mjOBJ_JOINT, compiled_.actuator_trnid[2 * a]) : "";
    if (joint && joints.insert(on).second)
      drives_.push_back({name, on, CommandField(compiled_, a)});
    else
      idle_.push_back(name);
  }
}

Status MjlabWriter::Check() const {
  const mjOption& option = input_.exported.spec->option;
  const bool still = std::ranges::all_of(option.wind, [](double x) { return x == 0; });
  if (option.density == 0 && option.viscosity == 0 && still) return Ok();
  return Error{.what = "the MJCF's <option> has air (density, viscosity or wind), which no setting of mjlab takes over",
               .where = input_.model.experiment().model_path,
               .allowed = "0",
               .cure = "export to mujoco_native or mujoco_warp, or take it out of the MJCF"};
}

std::string Flags(int bits, const char* const* names, int count) {
  std::vector<std::string> set;
  for (int i = 0; i < count; ++i) {
    if (!(bits & (1 << i))) continue;
    std::string name = names[i];
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
    set.push_back(PyText(name));
  }
  return PyTuple(set);
}

std::string MjlabWriter::Simulation() const {
  const mjOption& o = input_.exported.spec->option;
  constexpr const char *kCones[] = {"pyramidal", "elliptic"}, *kJacobians[] = {"dense", "sparse", "auto"},
                       *kSolvers[] = {"pgs", "cg", "newton"};
  return fmt::format(
      "# A scene takes over no <option> of an entity's MJCF.\n"
      "SIMULATION = SimulationCfg(\n"
      "  mujoco=MujocoCfg(\n"
      "    timestep={},\n    integrator=\"{}\",\n    impratio={},\n    cone=\"{}\",\n    jacobian=\"{}\",\n"
      "    solver=\"{}\",\n    iterations={},\n    tolerance={},\n    ls_iterations={},\n    ls_tolerance={},\n"
      "    ccd_iterations={},\n    gravity={},\n    disableflags={},\n    enableflags={},\n  )\n)\n",
      PyNumber(o.timestep), o.integrator == mjINT_EULER ? "euler" : "implicitfast", PyNumber(o.impratio),
      kCones[o.cone], kJacobians[o.jacobian], kSolvers[o.solver], o.iterations, PyNumber(o.tolerance), o.ls_iterations,
      PyNumber(o.ls_tolerance), o.ccd_iterations, PyNumbers(o.gravity),
      Flags(o.disableflags, mjDISABLESTRING, mjNDISABLE), Flags(o.enableflags, mjENABLESTRING, mjNENABLE));
}

int MjlabWriter::DelayRow(const std::string& drive) const {
  const auto& steps = input_.exported.delay_steps;
  return steps.contains(drive) ? static_cast<int>(std::distance(steps.begin(), steps.find(drive))) : -1;
}

// How late commands are, by what `robot` is asked for.
std::string MjlabWriter::Lags(const Drive& drive) const {
  const int row = DelayRow(drive.name);
  const int nominal = input_.exported.delay_steps.at(drive.name);
  std::string cases = fmt::format("None: _lag({0}, {0})", nominal);
  if (!input_.randomization) return "{" + cases + "}";
  const auto [low, high] = RangeOfDelay(*input_.randomization, static_cast<std::size_t>(row), nominal);
  double least = nominal, most = nominal;
  if (const DrawnField* drawn = FieldOf(*input_.randomization, kDelaySteps)) {
    for (auto i = static_cast<std::size_t>(row); i < drawn->values.size(); i += input_.exported.delay_steps.size())
      least = std::min(least, drawn->values[i]), most = std::max(most, drawn->values[i]);
  }
  return fmt::format("{{{}, \"ranges\": _lag({:.0f}, {:.0f}, 0.0), \"draws\": _lag({:.0f}, {:.0f}, 1.0)}}", cases, low,
                     high, least, most);
}

std::string MjlabWriter::Actuators() const {
  std::string lags, drives;
  for (const Drive& drive : drives_) {
    drives += fmt::format("    {}(\n      target_names_expr=({},),\n      command_field=\"{}\",\n",
                          HasLaw(drive.name) ? "LawCfg" : "XmlActuatorCfg", PyPattern(drive.joint), drive.field);
    if (HasLaw(drive.name)) drives += fmt::format("      law=LAWS[{}],\n", PyText(drive.name));
    if (DelayRow(drive.name) >= 0) {
      drives += fmt::format("      **LAGS[{}][randomize],\n", PyText(drive.name));
      lags += fmt::format("  {}: {},\n", PyText(drive.name), Lags(drive));
    }
    drives += "    ),\n";
  }
  std::string text =
      "# Lags are in physics steps, one per episode. A probability of 1 to hold them leaves them to `draw`.\n"
      "def _lag(least, most, hold=0.0):\n"
      "  return dict(\n"
      "    delay_min_lag=least, delay_max_lag=most, delay_hold_prob=hold,\n"
      "    delay_update_period=10**9, delay_per_env_phase=False,\n"
      "  )\n\n\n"
      "LAGS = {\n" +
      lags + "}\n\n\n";
  if (lags.empty()) text.clear();
  text += "def actuators(randomize=None):\n  return (\n" + drives + "  )\n";
  if (!idle_.empty())
    text += fmt::format("# mjlab drives one actuator of a joint: {} get no command.\n", fmt::join(idle_, ", "));
  return text;
}

std::string MjlabWriter::Robot() const {
  std::string angles, root;
  for (int j = 0; j < compiled_.njnt; ++j) {
    const mjtNum* at = compiled_.qpos0 + compiled_.jnt_qposadr[j];
    if (j == 0 && compiled_.jnt_type[j] == mjJNT_FREE)
      root = fmt::format("pos={}, rot={}, ", PyNumbers({at, 3}), PyNumbers({at + 3, 4}));
    if (compiled_.jnt_type[j] == mjJNT_HINGE || compiled_.jnt_type[j] == mjJNT_SLIDE)
      angles += fmt::format("{}: {}, ", PyPattern(NameOf(compiled_, mjOBJ_JOINT, j)), PyNumber(*at));
  }
  return fmt::format(
      "def robot(randomize=None):\n"
      "  \"\"\"The mechanism as the result says it is; randomize: None, \"ranges\" or \"draws\".\"\"\"\n"
      "  return EntityCfg(\n"
      "    spec_fn=lambda: mujoco.MjSpec.from_file(str(HERE / {})),\n"
      "    articulation=EntityArticulationInfoCfg(actuators=actuators(randomize)),\n"
      "    init_state=EntityCfg.InitialStateCfg({}joint_pos={{{}}}),\n"
      "  )\n",
      PyText(input_.mjcf), root, angles.empty() ? "" : angles.substr(0, angles.size() - 2));
}

std::string MjlabWriter::Ranges() const {
  std::string terms;
  std::vector<std::string> left;
  for (const ParameterRange& range : ranges()) {
    const bool alone = MayBeDrawnAlone(range, ranges());
    if (alone && range.numbers.front().field == kDelaySteps) continue;  // LAGS draws it
    const auto term = std::ranges::find_if(
        kDrTerms, [&](const DrTerm& dr) { return alone && range.numbers.front().field == dr.field; });
    const RowKind* kind = term == std::end(kDrTerms) ? nullptr : KindOf(term->field);
    const std::string joint = kind ? NameOfRow(compiled_, *kind, range.numbers.front().row) : "";
    if (joint.empty()) {
      left.push_back(range.name);
      continue;
    }
    terms += fmt::format(
        "    {}: EventTermCfg(\n      mode=\"startup\",\n      func=dr.{},\n"
        "      params={{\"ranges\": {{{}: ({}, {})}}, \"operation\": \"abs\", \"asset_cfg\": "
        "SceneEntityCfg(entity)}},\n"
        "    ),\n",
        PyText(range.name), term->function, PyPattern(joint), PyNumber(range.numbers.front().low),
        PyNumber(range.numbers.front().high));
  }
  return fmt::format(
      "def ranges(entity=\"robot\"):\n"
      "  \"\"\"Events, each a parameter's own 95 % range, drawn alone.{}\"\"\"\n"
      "  return {{\n{}  }}\n",
      left.empty() ? ""
                   : fmt::format("\n\n  As they are, since one term cannot draw them: {}.\n  `draws` varies them.\n  ",
                                 fmt::join(left, ", ")),
      terms);
}

// What varies, number by number.
std::string MjlabWriter::Drawn(std::set<std::string>* fields) const {
  std::map<std::string, std::set<std::string>> numbers;  // by field
  std::set<std::string> stay;
  for (const ParameterRange& range : ranges()) {
    for (const VaryingNumber& number : range.numbers) {
      const RowKind* kind = KindOf(number.field);
      if (number.field == kDelaySteps || number.field == kLaws) continue;
      const std::string name = kind ? NameOfRow(compiled_, *kind, number.row) : "";
      if (name.empty()) {
        stay.insert(number.field);
        continue;
      }
      if (HasLaw(name) && (number.field == "actuator_gainprm" || number.field == "actuator_biasprm")) continue;
      const bool matrix = std::ranges::any_of(input_.randomization->fields, [&](const DrawnField& field) {
        return field.name == number.field && field.shape.size() == 3;
      });
      numbers[number.field].insert(fmt::format("({}, {}, {}, ({}))", PyText(kind->kind), PyText(name), number.row,
                                               matrix ? fmt::format("{},", number.column) : ""));
    }
  }
  std::string text =
      "# Field of mjModel: kind and name of what varies, its row in randomization.npz, its column.\nDRAWN = {\n";
  for (const auto& [field, entries] : numbers) {
    fields->insert(PyText(field));
    text += fmt::format("  {}: (\n    {},\n  ),\n", PyText(field), fmt::join(entries, ",\n    "));
  }
  text += "}\n";
  if (!stay.empty()) text += fmt::format("# No environment has its own {}: as it is.\n", fmt::join(stay, ", "));
  return text;
}

std::string MjlabWriter::DrawnLags() const {
  std::string lags;
  for (std::size_t d = 0; d < drives_.size(); ++d) {
    if (const int row = DelayRow(drives_[d].name); row >= 0)
      lags += fmt::format(
          "  asset.actuators[{}].set_lags(torch.as_tensor(drawn[\"{}\"][row, {}], device=env.device).long(), "
          "env_ids)\n",
          d, kDelaySteps, row);
  }
  return lags;
}

// The joint draws, the lags and the laws.
std::string MjlabWriter::Draws() const {
  const bool late = FieldOf(*input_.randomization, kDelaySteps) != nullptr;
  std::set<std::string> fields;
  const std::string drawn = Drawn(&fields);
  const std::vector<std::string> names = Collect(drives_, &Drive::name);
  return drawn + fmt::format(R"(

def _index(asset, kind, name):
  at = asset.indexing
  if kind == "body":
    return at.body_ids[asset.body_names.index(name)]
  if kind == "actuator":
    return at.ctrl_ids[asset.actuator_names.index(name)]
  if kind == "tendon":
    return at.tendon_ids[asset.tendon_names.index(name)]
  joint = asset.joint_names.index(name)
  return {{"joint": at.joint_ids, "dof": at.joint_v_adr, "qpos": at.joint_q_adr}}[kind][joint]


@requires_model_fields({}recompute=RecomputeLevel.set_const)
def draw(env, env_ids, entity="robot"):
  """One joint draw for each environment: what goes together stays together."""
  drawn = np.load(HERE / "randomization.npz")
  asset = env.scene[entity]
  if env_ids is None:
    env_ids = torch.arange(env.num_envs, device=env.device)
  row = np.random.randint(0, len(drawn["parameters"]), len(env_ids))
  for field, entries in DRAWN.items():
    array = getattr(env.sim.model, field)
    for kind, name, of_row, column in entries:
      values = torch.as_tensor(drawn[field][(row, of_row, *column)], dtype=torch.float32, device=env.device)
      array[(env_ids, _index(asset, kind, name), *column)] = values
{}

def draws(entity="robot"):
  """The event that draws all parameters at once, from what the logs leave open."""
  return {{"gapscope": EventTermCfg(mode="{}", func=draw, params={{"entity": entity}})}}
)",
                             fields.empty() ? "" : fmt::format("{}, ", fmt::join(fields, ", ")),
                             (late ? DrawnLags() : "") + DrawnMjlabLaws(input_, names), late ? "reset" : "startup");
}

std::string MjlabWriter::Text() const {
  const bool random = input_.randomization != nullptr, laws = !input_.exported.laws.empty();
  std::string text = fmt::format(
      "\"\"\"A mechanism for mjlab 1.6, written by gapscope.\n\n"
      "from gapscope_mjlab import SIMULATION, robot{}\n"
      "SceneCfg(entities={{\"robot\": robot({})}}) and SIMULATION go into the environment's "
      "configuration{}.\n\"\"\"\n\n{}"
      "from pathlib import Path\n\nimport mujoco\n{}{}"
      "from mjlab.actuator import {}XmlActuatorCfg\n"
      "from mjlab.entity import EntityArticulationInfoCfg, EntityCfg\n{}"
      "from mjlab.sim import MujocoCfg, SimulationCfg\n\nHERE = Path(__file__).parent\n\n",
      random ? ", draws" : "", random ? "\"draws\"" : "", random ? ", as events draws()" : "",
      laws ? "from dataclasses import dataclass\n" : "", random ? "import numpy as np\n" : "",
      std::string(random || laws ? "import torch\n" : "") + (laws ? "from gapscope_torch import Drive\n" : ""),
      laws ? "XmlActuator, " : "",
      random ? "from mjlab.envs.mdp import dr\n"
               "from mjlab.managers.event_manager import EventTermCfg, RecomputeLevel, requires_model_fields\n"
               "from mjlab.managers.scene_entity_config import SceneEntityCfg\n"
             : "");
  text += Simulation() + "\n" + MjlabLaws(input_) + Actuators() + "\n\n" + Robot();
  if (random) text += "\n\n" + Ranges() + "\n\n" + Draws();
  return text;
}

Result<std::vector<TargetFile>> WriteMjlab(const TargetInput& input) {
  const MjlabWriter writer(input);
  GS_RETURN_IF_ERROR(writer.Check());
  std::vector<TargetFile> files = LawFiles(input);
  files.insert(files.begin(), {"gapscope_mjlab.py", writer.Text()});
  return files;
}

}  // namespace

ExportTarget Target_mjlab() {
  return {.name = "mjlab",
          .what = "mjlab 1.6",
          .has = {.passive_motors = PassiveMotors::kIdleInput,
                  .delays = CommandDelays::kWholeSteps,
                  .runge_kutta = false,
                  .drive_laws = true},
          .mujoco_3_11 = true,
          .files = WriteMjlab};
}

}  // namespace gapscope
