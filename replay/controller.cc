#include "replay/controller.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "src/core/statistics.h"
#include "src/experiment/yaml_reader.h"

namespace gapscope {
namespace {

template <class List>
std::size_t IndexOf(const List& inputs, const std::string& name) {
  return static_cast<std::size_t>(
      std::find_if(inputs.begin(), inputs.end(), [&](const auto& i) { return i.name == name; }) - inputs.begin());
}

// One step of D(e), N s / (s + N) by backward differences: what it was, and by how much e has changed.
double FilteredDerivative(double derivative, double change, double filter_rad_per_s, double period_s) {
  return (filter_rad_per_s * change + derivative) / (1 + filter_rad_per_s * period_s);
}

Status ReadInputs(YamlMap& map, const std::string& path, const Experiment& experiment, ControllerSpec* spec) {
  for (const YAML::Node& item : map.List("inputs")) {
    YamlMap one(item, path, "an input of the controller");
    ControllerInput input{.name = one.Text("name"),
                          .signal = one.Text("signal"),
                          .scale = one.Number("scale", 1),
                          .offset = one.Number("add", 0)};
    const bool known = std::any_of(experiment.measured.begin(), experiment.measured.end(),
                                   [&](const auto& m) { return m.signal == input.signal; });
    if (!known)
      one.Fail(item,
               {.what = "the controller reads a signal that is not measured", .actual = "'" + input.signal + "'"});
    GS_RETURN_IF_ERROR(one.Finish());
    spec->inputs.push_back(std::move(input));
  }
  return Ok();
}

Result<std::vector<ControllerTerm>> ReadTerms(YamlMap& map, const std::string& path,
                                              const std::vector<ControllerInput>& inputs) {
  std::vector<ControllerTerm> terms;
  for (const YAML::Node& item : map.List("terms")) {
    YamlMap one(item, path, "a term of the controller");
    ControllerTerm term{.input = one.Text("input"),
                        .proportional = one.Number("proportional", 0),
                        .integral = one.Number("integral", 0),
                        .derivative = one.Number("derivative", 0),
                        .filter_rad_per_s = one.Number("filter_rad_per_s", 100),
                        .integral_limit = one.Number("integral_limit", 0),
                        .to = one.Text("to", "")};
    for (const std::string& name : {term.input, term.to}) {
      if (!name.empty() && IndexOf(inputs, name) == inputs.size())
        one.Fail(item, {.what = "a term of an input that is not there", .actual = "'" + name + "'"});
    }
    if (!(term.filter_rad_per_s > 0) || term.integral_limit < 0)
      one.Fail(item, {.what = "'filter_rad_per_s' must be above zero, 'integral_limit' not below"});
    GS_RETURN_IF_ERROR(one.Finish());
    terms.push_back(std::move(term));
  }
  return terms;
}

Status ReadSwingUp(const YAML::Node& node, const std::string& path, ControllerSpec* spec) {
  if (!node.IsDefined()) return Ok();
  YamlMap one(node, path, "'swing_up'");
  SwingUp swing{.input = one.Text("input"),
                .arm = one.Text("arm", ""),
                .catch_rad = one.Number("catch_rad"),
                .drop_rad = one.Number("drop_rad", 0),
                .gain = 0,
                .inertia_kg_m2 = 0,
                .torque_n_m = 0,
                .filter_rad_per_s = one.Number("filter_rad_per_s", 100),
                .limit = one.Number("limit", 0),
                .arm_speed = one.Number("arm_speed", 0),
                .terms = {}};
  GS_ASSIGN(swing.terms, ReadTerms(one, path, spec->inputs));
  if (swing.terms.empty() || one.Child("gain").IsDefined()) {
    swing.gain = one.Number("gain");
    swing.inertia_kg_m2 = one.Number("inertia_kg_m2");
    swing.torque_n_m = one.Number("torque_n_m");
    if (!(swing.inertia_kg_m2 > 0 && swing.torque_n_m > 0))
      one.Fail(node, {.what = "'inertia_kg_m2' and 'torque_n_m' are above zero"});
  }
  for (const std::string& name : {swing.input, swing.arm}) {
    if (!name.empty() && IndexOf(spec->inputs, name) == spec->inputs.size())
      one.Fail(node, {.what = "a swing-up of an input that is not there", .actual = "'" + name + "'"});
  }
  if (swing.arm.empty() && swing.arm_speed != 0)
    one.Fail(node, {.what = "'arm_speed' needs the input 'arm' whose speed it multiplies"});
  if (swing.drop_rad == 0) swing.drop_rad = 2 * swing.catch_rad;
  if (!(swing.catch_rad > 0 && swing.drop_rad >= swing.catch_rad && swing.filter_rad_per_s > 0 && swing.limit >= 0)) {
    one.Fail(node, {.what = "'catch_rad' and 'filter_rad_per_s' are above zero, 'drop_rad' is not below 'catch_rad'"});
  }
  GS_RETURN_IF_ERROR(one.Finish());
  spec->swing_up = std::move(swing);
  return Ok();
}

// A list of rows, each a list of `columns` numbers.
Eigen::MatrixXd ReadMatrix(YamlMap& map, const char* key, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(rows, columns);
  const std::vector<YAML::Node> lines = map.List(key);
  const YAML::Node at = map.Child(key);
  const auto wrong = [&] {
    map.Fail(at, {.what = std::string("'") + key + "' is not a matrix of this size",
                  .allowed = std::to_string(rows) + " lists of " + std::to_string(columns) + " numbers"});
    return Eigen::MatrixXd(Eigen::MatrixXd::Zero(rows, columns));
  };
  if (static_cast<Eigen::Index>(lines.size()) != rows) return wrong();
  for (Eigen::Index i = 0; i < rows; ++i) {
    const YAML::Node& line = lines[static_cast<std::size_t>(i)];
    if (!line.IsSequence() || static_cast<Eigen::Index>(line.size()) != columns) return wrong();
    for (Eigen::Index j = 0; j < columns; ++j) {
      double value = 0;
      if (!YAML::convert<double>::decode(line[static_cast<std::size_t>(j)], value) || !std::isfinite(value))
        return wrong();
      matrix(i, j) = value;
    }
  }
  return matrix;
}

Status ReadObserver(const YAML::Node& node, const std::string& path, ControllerSpec* spec) {
  if (!node.IsDefined()) return Ok();
  YamlMap one(node, path, "'observer'");
  const auto n = static_cast<Eigen::Index>(one.List("a").size()),
             inputs = static_cast<Eigen::Index>(spec->inputs.size());
  ObserverSpec observer{.a = ReadMatrix(one, "a", n, n),
                        .c = ReadMatrix(one, "c", inputs, n),
                        .gain = ReadMatrix(one, "gain", n, inputs),
                        .b = {},
                        .feedback = {}};
  const std::vector<double> b = one.NumberList("b", static_cast<std::size_t>(n)),
                            feedback = one.NumberList("feedback", static_cast<std::size_t>(n));
  if (n == 0 || b.empty() || feedback.empty())
    one.Fail(node, {.what = "an observer needs 'a', 'b', 'c', 'gain' and 'feedback'"});
  GS_RETURN_IF_ERROR(one.Finish());
  observer.b = Eigen::Map<const Eigen::VectorXd>(b.data(), n);
  observer.feedback = Eigen::Map<const Eigen::VectorXd>(feedback.data(), n);
  spec->observer = std::move(observer);
  return Ok();
}

}  // namespace

Result<ControllerSpec> LoadController(const Experiment& experiment) {
  const std::string& path = experiment.path;
  GS_ASSIGN(const YAML::Node root, ReadYaml(path));
  const YAML::Node node = root["controller"];
  if (!node.IsDefined()) {
    return Error{.what = "no controller is described",
                 .where = path,
                 .cure = "add 'controller:' (docs/reference/experiment.md), or replay in free_run or windows"};
  }
  YamlMap map(node, path, "'controller'");
  ControllerSpec spec{.actuator = map.Text("actuator"),
                      .sample_s = map.Number("sample_s", 0),
                      .limit = map.Number("limit", 0),
                      .inputs = {},
                      .references = {},
                      .feedforward = map.Text("feedforward", ""),
                      .terms = {},
                      .swing_up = {},
                      .observer = {}};
  if (spec.sample_s < 0 || spec.limit < 0) map.Fail(node, {.what = "'sample_s' and 'limit' are not negative"});
  if (std::none_of(experiment.commands.begin(), experiment.commands.end(),
                   [&](const auto& c) { return c.actuator == spec.actuator; })) {
    map.Fail(node, {.what = "the controller drives an actuator without a command",
                    .actual = "'" + spec.actuator + "'",
                    .cure = "name one of 'commands:'"});
  }
  GS_RETURN_IF_ERROR(ReadInputs(map, path, experiment, &spec));
  if (const YAML::Node references = map.Child("references"); references.IsDefined()) {
    YamlMap names(references, path, "'references'");
    for (const auto& pair : references) {
      if (!pair.first.IsScalar()) break;
      const std::string name = pair.first.Scalar();
      if (IndexOf(spec.inputs, name) == spec.inputs.size())
        names.Fail(pair.first, {.what = "a reference for an input that is not there", .actual = "'" + name + "'"});
      spec.references[name] = names.Text(name.c_str());
    }
    GS_RETURN_IF_ERROR(names.Finish());
  }
  GS_ASSIGN(spec.terms, ReadTerms(map, path, spec.inputs));
  GS_RETURN_IF_ERROR(ReadSwingUp(map.Child("swing_up"), path, &spec));
  GS_RETURN_IF_ERROR(ReadObserver(map.Child("observer"), path, &spec));
  if (spec.terms.empty() && !spec.observer)
    map.Fail(node, {.what = "the controller has neither 'terms' nor 'observer'"});
  GS_RETURN_IF_ERROR(map.Finish());
  return spec;
}

// What a text of the spec stands for: a number, or a column of the log, which is read when the first one asks for it.
class Controller::Binder {
 public:
  Binder(const Experiment& experiment, const Recording& recording) : experiment_(experiment), recording_(recording) {}

  // `what` names the text in an error.
  Result<Source> Bind(const std::string& text, const std::string& what) {
    Source source;
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), source.constant);
    if (parsed.ec == std::errc() && parsed.ptr == text.data() + text.size() && std::isfinite(source.constant))
      return source;
    if (!log_) {
      GS_ASSIGN(log_, ReadLog(recording_.log_path, experiment_.read));
    }
    const Column* column = log_->Find(text);
    if (!column)
      return Error{.what = what + " is neither a column of the log nor a number",
                   .where = recording_.log_path,
                   .actual = "'" + text + "'",
                   .cure = "see 'controller:' in " + experiment_.path};
    GS_ASSIGN(source.column,
              ExtractColumn(*log_, recording_.timeline, *column,
                            {.factor = 1, .offset = 0, .missing = experiment_.timeline.missing}, nullptr));
    return source;
  }

 private:
  const Experiment& experiment_;
  const Recording& recording_;
  std::optional<Log> log_;
};

Result<Controller> Controller::Make(const ControllerSpec& spec, const Experiment& experiment,
                                    const Recording& recording) {
  Controller controller;
  controller.spec_ = spec;
  controller.recording_ = &recording;
  for (std::size_t c = 0; c < recording.commands.size(); ++c) {
    if (recording.commands[c].actuator == spec.actuator) controller.command_ = c;
  }
  Binder binder(experiment, recording);
  for (const auto& input : spec.inputs) {
    const auto signal = std::find_if(recording.measured.begin(), recording.measured.end(),
                                     [&](const auto& m) { return m.spec.signal == input.signal; });
    if (signal == recording.measured.end())
      return Error{.what = "the controller reads a signal that the log lacks",
                   .where = recording.log_path,
                   .actual = "'" + input.signal + "'"};
    Input bound{.signal = static_cast<std::size_t>(signal - recording.measured.begin()),
                .scale = input.scale,
                .offset = input.offset,
                .reference = {}};
    if (const auto reference = spec.references.find(input.name); reference != spec.references.end()) {
      GS_ASSIGN(bound.reference, binder.Bind(reference->second, "the reference of '" + input.name + "'"));
    }
    controller.inputs_.push_back(std::move(bound));
  }
  const auto bound = [&](const ControllerTerm& term) {
    return Term{.spec = term,
                .input = IndexOf(spec.inputs, term.input),
                .to = term.to.empty() ? -1 : static_cast<int>(IndexOf(spec.inputs, term.to))};
  };
  for (const auto& term : spec.terms) controller.terms_.push_back(bound(term));
  if (!spec.feedforward.empty()) {
    GS_ASSIGN(controller.feedforward_, binder.Bind(spec.feedforward, "the feedforward"));
  }
  if (spec.swing_up) {
    controller.swing_input_ = IndexOf(spec.inputs, spec.swing_up->input);
    controller.arm_input_ =
        spec.swing_up->arm.empty() ? controller.swing_input_ : IndexOf(spec.inputs, spec.swing_up->arm);
    for (const auto& term : spec.swing_up->terms) controller.swing_terms_.push_back(bound(term));
  }
  if (spec.observer) controller.observer_.emplace(*spec.observer);
  controller.errors_.resize(controller.inputs_.size());
  controller.inputs_now_.resize(controller.inputs_.size());
  controller.references_now_.resize(controller.inputs_.size());
  controller.Reset(Start::kZero);
  return controller;
}

void Controller::Reset(Start start) {
  for (auto* terms : {&terms_, &swing_terms_}) {
    for (auto& term : *terms) term.last_error = term.derivative = term.integral = 0;
  }
  if (observer_) observer_->Reset();
  law_ = sent_ = swing_angle_ = swing_speed_ = arm_angle_ = arm_speed_ = last_s_ = 0;
  next_s_ = -kInfinity;
  first_ = true, start_ = start, caught_ = !spec_.swing_up.has_value();
}

double Controller::Evaluate(Term& term, double error, double period_s) const {
  if (first_ && start_ == Start::kSettled) term.last_error = error;
  term.derivative = FilteredDerivative(term.derivative, error - term.last_error, term.spec.filter_rad_per_s, period_s);
  term.last_error = error;
  term.integral += term.spec.integral * error * period_s;
  if (term.spec.integral_limit > 0)
    term.integral = std::clamp(term.integral, -term.spec.integral_limit, term.spec.integral_limit);
  return term.spec.proportional * error + term.integral + term.spec.derivative * term.derivative;
}

double Controller::Sum(std::vector<Term>& terms, double period_s) {
  double sum = 0;
  for (auto& term : terms) {
    if (term.to >= 0) errors_[static_cast<std::size_t>(term.to)] += Evaluate(term, errors_[term.input], period_s);
  }
  for (auto& term : terms) {
    if (term.to < 0) sum += Evaluate(term, errors_[term.input], period_s);
  }
  return sum;
}

double Controller::Swing(const SwingUp& swing, double angle, double period_s) {
  const double turned = first_ ? 0 : std::remainder(angle - swing_angle_, 2 * std::numbers::pi);
  swing_speed_ = FilteredDerivative(swing_speed_, turned, swing.filter_rad_per_s, period_s);
  swing_angle_ = angle;
  const double arm = inputs_now_[arm_input_];
  arm_speed_ = FilteredDerivative(arm_speed_, first_ ? 0 : arm - arm_angle_, swing.filter_rad_per_s, period_s);
  arm_angle_ = arm;
  caught_ = std::abs(angle) < (caught_ ? swing.drop_rad : swing.catch_rad);
  const double energy =
      0.5 * swing.inertia_kg_m2 * swing_speed_ * swing_speed_ + swing.torque_n_m * (std::cos(angle) - 1);
  const double direction = swing_speed_ * std::cos(angle);
  // Hanging at rest no direction is better: a push.
  const double torque = swing.gain * -energy * (direction < 0 ? -1 : 1);
  return (swing.limit > 0 ? std::clamp(torque, -swing.limit, swing.limit) : torque) + swing.arm_speed * arm_speed_;
}

double Controller::Step(std::size_t row, std::span<const double> readings) {
  const double now = recording_->time_s[row];
  if (now < next_s_ - 1e-9) return sent_;
  const double period = spec_.sample_s > 0 ? spec_.sample_s : recording_->timeline.median_step_s;
  next_s_ = spec_.sample_s > 0 ? (first_ ? now : next_s_) + spec_.sample_s : now;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    inputs_now_[i] = inputs_[i].scale * readings[inputs_[i].signal] + inputs_[i].offset;
    // An angle that goes round: the nearest way up, on either side.
    if (spec_.swing_up && i == swing_input_) inputs_now_[i] = std::remainder(inputs_now_[i], 2 * std::numbers::pi);
    references_now_[i] = inputs_[i].reference.At(row);
    errors_[i] = references_now_[i] - inputs_now_[i];
  }
  double pumped = 0;
  if (spec_.swing_up) pumped = Swing(*spec_.swing_up, inputs_now_[swing_input_], period);
  asked_ = errors_;
  // The observer hears what was really sent, saturation included. All laws run on, so that their filters are where the
  // motion is when they take over.
  law_ = (observer_ ? observer_->Step(inputs_now_, references_now_, sent_, period) : 0) + Sum(terms_, period);
  if (!swing_terms_.empty()) {
    errors_ = asked_;
    pumped += Sum(swing_terms_, period);
  }
  if (!caught_) {
    law_ = pumped;
    for (auto& term : terms_) term.integral = 0;
  }
  first_ = false;
  sent_ = law_ + feedforward_.At(row);
  if (spec_.limit > 0) sent_ = std::clamp(sent_, -spec_.limit, spec_.limit);
  return sent_;
}

}  // namespace gapscope
