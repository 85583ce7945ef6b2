// Sources: the wheels isaaclab 2.3.2.post1 and 3.0.0, assets/articulation (what is written to the simulation),
// envs/mdp/events.py (masses and gains), utils/buffers/delay_buffer.py, and envs/manager_based_env.py: events of a
// reset come after the scene's own.
#include "src/export/isaaclab_draws.h"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "src/export/drive_laws.h"
#include "src/export/python_text.h"
#include "src/model/element_names.h"

namespace gapscope {
namespace {

class DrawsWriter {
 public:
  DrawsWriter(const TargetInput& input, const IsaacLabNames& names, const std::vector<DrawnDrive>& drives)
      : input_(input), names_(names), drives_(drives), compiled_(*input.exported.compiled) {}

  IsaacLabDraws Write();

 private:
  // The field varies in this row, and in this column of it. What is asked for is taken to be drawn.
  bool Takes(const std::string& field, std::size_t row, std::size_t column = 0);
  bool Varies(const std::string& field, std::size_t row) const;
  static std::string Of(const char* field, int row) { return fmt::format("of(\"{}\", {})", field, row); }
  std::string Call(const char* method, const std::string& arguments) const;
  std::string Joint(const DrawnDrive& drive);
  bool IsServo(int actuator) const;
  std::string Gains(const DrawnDrive& drive, int actuator);
  std::string Limit(const DrawnDrive& drive);
  std::string Laws() const;
  bool InertiaFollowsMass(int body) const;
  std::string Bodies();
  std::string Lags();
  std::string Left(const std::string& indent) const;

  const TargetInput& input_;
  const IsaacLabNames& names_;
  const std::vector<DrawnDrive>& drives_;
  const mjModel& compiled_;
  std::set<std::string> taken_;  // FIELD ROW COLUMN
  std::vector<std::string> host_;
};

std::string Place(const std::string& field, std::size_t row, std::size_t column) {
  return fmt::format("{} {} {}", field, row, column);
}

bool DrawsWriter::Varies(const std::string& field, std::size_t row) const {
  return std::ranges::any_of(input_.randomization->ranges, [&](const ParameterRange& range) {
    return std::ranges::any_of(range.numbers,
                               [&](const VaryingNumber& number) { return number.field == field && number.row == row; });
  });
}

bool DrawsWriter::Takes(const std::string& field, std::size_t row, std::size_t column) {
  taken_.insert(Place(field, row, column));
  return std::ranges::any_of(input_.randomization->ranges, [&](const ParameterRange& range) {
    return std::ranges::any_of(range.numbers, [&](const VaryingNumber& number) {
      return number.field == field && number.row == row && number.column == column;
    });
  });
}

std::string DrawsWriter::Call(const char* method, const std::string& arguments) const {
  return fmt::format("  asset.{}{}({}, **at)\n", method, names_.by_index, arguments);
}

// A servo whose gain is its stiffness in every draw: its target is the command.
bool DrawsWriter::IsServo(int actuator) const {
  const DrawnField *gains = FieldOf(*input_.randomization, "actuator_gainprm"),
                   *biases = FieldOf(*input_.randomization, "actuator_biasprm");
  const auto row = static_cast<std::size_t>(actuator);
  if (!gains || !biases) return false;
  for (std::size_t draw = 0; draw < gains->shape[0]; ++draw) {
    const std::size_t of_draw = draw * gains->shape[1] + row;
    if (gains->values[of_draw * mjNGAIN] != -biases->values[of_draw * mjNBIAS + 1]) return false;
  }
  return true;
}

// Where the joint's own is the only one.
std::string DrawsWriter::Limit(const DrawnDrive& drive) {
  const int actuator = DriveOn(compiled_, drive.joint);
  const auto row = static_cast<std::size_t>(drive.joint);
  if (actuator < 0 || drive.by_law || compiled_.actuator_forcelimited[actuator] || !Varies("jnt_actfrcrange", row))
    return "";
  Takes("jnt_actfrcrange", row, 0), Takes("jnt_actfrcrange", row, 1);
  const std::string limit = fmt::format("of(\"jnt_actfrcrange\", {}, 1)", drive.joint);
  return drive.late
             ? fmt::format("  asset.actuators[{}].{}[env_ids] = {}\n", PyText(drive.name), names_.explicit_limit, limit)
             : Call("write_joint_effort_limit_to_sim", "limits=" + limit);
}

// Gains of the drive itself, or of a spring that an implicit drive stands for.
std::string DrawsWriter::Gains(const DrawnDrive& drive, int actuator) {
  std::string stiffness, damping;
  if (actuator < 0) {
    const auto joint = static_cast<std::size_t>(drive.joint);
    if (Takes("jnt_stiffness", joint)) stiffness = Of("jnt_stiffness", drive.joint);
    if (Takes("qpos_spring", static_cast<std::size_t>(compiled_.jnt_qposadr[drive.joint])))
      host_.push_back(
          fmt::format("the target of \"{}\" is qpos_spring[row, {}]", drive.name, compiled_.jnt_qposadr[drive.joint]));
  } else if (drive.by_law) {
    for (std::size_t column = 0; column < 3; ++column) {
      Takes("actuator_gainprm", static_cast<std::size_t>(actuator), column);
      Takes("actuator_biasprm", static_cast<std::size_t>(actuator), column);
    }
  } else {
    const auto row = static_cast<std::size_t>(actuator);
    const double gear = compiled_.actuator_gear[6 * actuator];
    const auto at_joint = [&](int column) {
      return fmt::format("{}of(\"actuator_biasprm\", {}, {})", gear == 1 ? "-" : PyNumber(-gear * gear) + " * ",
                         actuator, column);
    };
    if (Takes("actuator_biasprm", row, 1)) stiffness = at_joint(1);
    if (Takes("actuator_biasprm", row, 2)) damping = at_joint(2);
    const bool effort = compiled_.actuator_biasprm[actuator * mjNBIAS + 1] == 0;
    if ((effort || IsServo(actuator)) && Takes("actuator_gainprm", row) && effort)
      host_.push_back(fmt::format("efforts of \"{}\" are {}actuator_gainprm[row, {}, 0] times the command", drive.name,
                                  gear == 1 ? "" : fmt::format("{:.6g} times ", gear), actuator));
  }
  std::string text;
  for (const auto& [name, value] : {std::pair{"stiffness", stiffness}, std::pair{"damping", damping}}) {
    if (value.empty()) continue;
    text += drive.late ? fmt::format("  asset.actuators[{}].{}[env_ids] = {}\n", PyText(drive.name), name, value)
                       : Call(fmt::format("write_joint_{}_to_sim", name).c_str(), fmt::format("{}={}", name, value));
  }
  return text;
}

std::string DrawsWriter::Joint(const DrawnDrive& drive) {
  const int dof = compiled_.jnt_dofadr[drive.joint];
  const auto row = static_cast<std::size_t>(dof);
  std::string text = Gains(drive, DriveOn(compiled_, drive.joint)) + Limit(drive);
  const bool dry = Takes("dof_frictionloss", row), viscous = Takes("dof_damping", row);
  const auto value = [&](bool varies, const char* field, double number) {
    return varies ? Of(field, dof) : fmt::format("all_of({})", PyNumber(number));
  };
  if (dry || viscous) {
    const std::string friction = value(dry, "dof_frictionloss", compiled_.dof_frictionloss[dof]);
    text += Call("write_joint_friction_coefficient_to_sim",
                 fmt::format("\n    joint_friction_coeff={0},\n    joint_dynamic_friction_coeff={0},\n"
                             "    joint_viscous_friction_coeff={1}",
                             friction, value(viscous, "dof_damping", compiled_.dof_damping[dof])));
  }
  if (Takes("dof_armature", row)) text += Call("write_joint_armature_to_sim", "armature=" + Of("dof_armature", dof));
  if (text.empty()) return "";
  return fmt::format("  at = {{\"joint_ids\": [asset.joint_names.index({})], \"env_ids\": env_ids}}\n",
                     PyText(NameOf(compiled_, mjOBJ_JOINT, drive.joint))) +
         text;
}

std::string DrawsWriter::Laws() const {
  std::string text;
  for (const LawArgument& argument : VaryingLawArguments(input_))
    text += fmt::format("  asset.actuators[{}].drive.vary(\"{}\", of(\"{}\", {})[:, 0], env_ids, env.scene.num_envs)\n",
                        PyText(argument.drive), argument.name, kLaws, argument.row);
  return text;
}

// As much more of each moment as of the mass, in every draw.
bool DrawsWriter::InertiaFollowsMass(int body) const {
  constexpr double kPrinted = 3e-5;  // of the largest moment, what digits of an MJCF leave to a rod's smallest
  const DrawnField *masses = FieldOf(*input_.randomization, "body_mass"),
                   *moments = FieldOf(*input_.randomization, "body_inertia");
  if (!masses || !moments) return false;
  const auto bodies = masses->shape[1], row = static_cast<std::size_t>(body);
  const double* own = compiled_.body_inertia + 3 * row;
  const double largest = std::max({own[0], own[1], own[2]});
  for (std::size_t draw = 0; draw < masses->shape[0]; ++draw) {
    const double factor = masses->values[draw * bodies + row] / compiled_.body_mass[body];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double moment = moments->values[3 * (draw * bodies + row) + axis];
      if (std::abs(moment - factor * own[axis]) > kPrinted * factor * largest) return false;
    }
  }
  return true;
}

// Bodies that Isaac Lab has too: those with a joint. Their frame of inertia is the USD's, so that only what is in
// proportion to the mass is written.
std::string DrawsWriter::Bodies() {
  std::string text;
  for (int b = 1; b < compiled_.nbody; ++b) {
    const auto row = static_cast<std::size_t>(b);
    const bool moves = Varies("body_ipos", row) || Varies("body_iquat", row);
    if (compiled_.body_jntnum[b] == 0 || moves || !Varies("body_mass", row) || !InertiaFollowsMass(b)) continue;
    Takes("body_mass", row);
    for (std::size_t axis = 0; axis < 3; ++axis) Takes("body_inertia", row, axis);
    text += fmt::format("  set_mass(asset, asset.body_names.index({}), {}, env_ids)\n",
                        PyText(NameOf(compiled_, mjOBJ_BODY, b)), Of("body_mass", b));
  }
  return text;
}

std::string DrawsWriter::Lags() {
  if (!FieldOf(*input_.randomization, kDelaySteps)) return "";
  std::string text;
  for (const DrawnDrive& drive : drives_) {
    const auto& late = input_.exported.delay_steps;
    if (!drive.late || !late.contains(drive.name)) continue;
    const auto row = static_cast<std::size_t>(std::distance(late.begin(), late.find(drive.name)));
    if (Takes(kDelaySteps, row)) text += fmt::format("  {}: {},\n", PyText(drive.name), row);
  }
  return text;
}

// Parameters of which some number is not drawn, and why that is so.
std::string DrawsWriter::Left(const std::string& indent) const {
  std::string text;
  for (const ParameterRange& range : input_.randomization->ranges) {
    std::set<std::string> fields;
    for (const VaryingNumber& number : range.numbers) {
      if (number.field != kLaws && !taken_.contains(Place(number.field, number.row, number.column)))
        fields.insert(number.field);
    }
    if (!fields.empty()) text += fmt::format("{}# - {}: {}\n", indent, range.name, fmt::join(fields, ", "));
  }
  if (!text.empty())
    text = indent + "# As it is in all environments, since Isaac Lab takes no such number of each:\n" + text;
  if (!host_.empty()) text += indent + "# Of whoever sends commands, with row = ROWS[\"robot\"]:\n";
  for (const std::string& what : host_) text += fmt::format("{}# - {}\n", indent, what);
  return text;
}

constexpr char kDrawHead[] = R"(HERE = Path(__file__).parent
DRAWN = dict(np.load(HERE / "randomization.npz"))
# The row of DRAWN that each environment has, by the name of the articulation.
ROWS = {}


def environments(env, env_ids):
  every = torch.arange(env.scene.num_envs, device=env.device)
  return every if env_ids is None else every[env_ids]


)";

std::string SetMass(const IsaacLabNames& names) {
  const bool by_index = !names.by_index.empty();
  return std::string(R"(def set_mass(asset, body, masses, env_ids):
  """The inertia grows with the mass."""
)") + (by_index ? R"(  at = {"body_ids": [body], "env_ids": env_ids}
  factors = masses / asset.data.body_mass.torch[env_ids][:, [body]]
  inertias = asset.data.body_inertia.torch[env_ids][:, [body]] * factors[..., None]
  asset.set_masses_index(masses=masses, **at)
  asset.set_inertias_index(inertias=inertias, **at)


)"
                : R"(  rows, view = env_ids.cpu(), asset.root_physx_view
  all_masses, all_inertias, masses = view.get_masses(), view.get_inertias(), masses[:, 0].cpu()
  all_inertias[rows, body] *= (masses / all_masses[rows, body])[:, None]
  all_masses[rows, body] = masses
  view.set_masses(all_masses, rows)
  view.set_inertias(all_inertias, rows)


)");
}

std::string LateText(const std::string& lags) {
  return "LATE = {\n" + lags + R"(}


def draw_late(env, env_ids, asset_cfg):
  """How late the commands of each environment's row are; Isaac Lab's own reset, which comes before, draws that anew."""
  env_ids = environments(env, env_ids)
  for drive, column in LATE.items():
    actuator = env.scene[asset_cfg.name].actuators[drive]
    steps = torch.as_tensor(DRAWN["delay_steps"][ROWS[asset_cfg.name][env_ids.cpu().numpy()], column])
    for buffer in (actuator.positions_delay_buffer, actuator.velocities_delay_buffer, actuator.efforts_delay_buffer):
      buffer.set_time_lag(steps.int().to(env.device), env_ids)


)";
}

// Delays as long as any draw's need a buffer as long.
std::string DrawnActuators(const TargetInput& input, const std::vector<DrawnDrive>& drives) {
  const DrawnField& drawn = *FieldOf(*input.randomization, kDelaySteps);
  const auto& late = input.exported.delay_steps;
  std::string text =
      "\n# With DRAWS, in the place of ACTUATORS: what holds the longest delay.\nDRAWN_ACTUATORS = {\n"
      "  **ACTUATORS,\n";
  for (const DrawnDrive& drive : drives) {
    if (!drive.late || !late.contains(drive.name)) continue;
    const auto row = static_cast<std::size_t>(std::distance(late.begin(), late.find(drive.name)));
    double least = late.at(drive.name), most = least;
    for (std::size_t i = row; i < drawn.values.size(); i += drawn.shape[1])
      least = std::min(least, drawn.values[i]), most = std::max(most, drawn.values[i]);
    text += fmt::format("  {0}: ACTUATORS[{0}].replace(min_delay={1:.0f}, max_delay={2:.0f}),\n", PyText(drive.name),
                        least, most);
  }
  return text + "}\n";
}

IsaacLabDraws DrawsWriter::Write() {
  std::string body;
  for (const DrawnDrive& drive : drives_) body += Joint(drive);
  body += Laws();
  const std::string masses = Bodies(), lags = Lags();
  body += masses;
  if (body.empty() && lags.empty() && host_.empty()) {
    const std::string left = Left("");
    return {.functions = "", .terms = left.empty() ? "" : "\n# No DRAWS.\n" + left};
  }
  IsaacLabDraws draws{.functions = kDrawHead, .late = !lags.empty()};
  if (!masses.empty()) draws.functions += SetMass(names_);
  draws.functions += R"(def draw(env, env_ids, asset_cfg):
  """One row of the joint draws for each environment: what goes together stays together."""
  asset, env_ids = env.scene[asset_cfg.name], environments(env, env_ids)
  row = np.random.randint(0, len(DRAWN["parameters"]), len(env_ids))
  ROWS.setdefault(asset_cfg.name, np.zeros(env.scene.num_envs, dtype=int))[env_ids.cpu().numpy()] = row

  def of(field, *at):
    return torch.as_tensor(DRAWN[field][(row, *at)], dtype=torch.float32, device=env.device)[:, None]

)";
  if (body.find("all_of(") != std::string::npos)
    draws.functions +=
        "  def all_of(value):\n"
        "    return torch.full((len(env_ids), 1), value, device=env.device)\n\n";
  draws.functions += body + Left("  ") + "\n\n";
  if (draws.late) draws.functions += LateText(lags);
  draws.terms =
      "\n# In the place of EVENTS: each environment has a row of randomization.npz.\nDRAWS = {\n"
      "  \"draw\": EventTermCfg(func=draw, mode=\"startup\", params={\"asset_cfg\": SceneEntityCfg(\"robot\")}),\n";
  if (draws.late)
    draws.terms +=
        "  \"late\": EventTermCfg(func=draw_late, mode=\"reset\", params={\"asset_cfg\": "
        "SceneEntityCfg(\"robot\")}),\n";
  draws.terms += "}\n" + (draws.late ? DrawnActuators(input_, drives_) : "");
  return draws;
}

}  // namespace

IsaacLabDraws WriteIsaacLabDraws(const TargetInput& input, const IsaacLabNames& names,
                                 const std::vector<DrawnDrive>& drives) {
  if (!input.randomization) return {};
  return DrawsWriter(input, names, drives).Write();
}

}  // namespace gapscope
