// What a candidate of the experiment's own makes of its parameters: the torques of a dozen motions, or the fields that
// it changes.
#ifndef GAPSCOPE_MODEL_OWN_PROBE_H_
#define GAPSCOPE_MODEL_OWN_PROBE_H_

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "src/core/result.h"
#include "src/experiment/experiment.h"
#include "src/model/structure.h"

namespace gapscope {

class OwnProbe {
 public:
  using Values = std::vector<double>;

  virtual ~OwnProbe() = default;
  OwnProbe(const OwnProbe&) = delete;
  OwnProbe& operator=(const OwnProbe&) = delete;

  // At these values of the parameters, in the order of OwnEffect::parameters.
  virtual Values At(const Values& parameters) = 0;
  // Whether the joint's own angle and speed are all that decides.
  virtual bool IsOfMotion() = 0;

  Values AtNeutral();
  // Parameter i moved from there alone.
  Values Alone(std::size_t i);
  // All moved, i to this value.
  Values Beside(std::size_t i, double value);
  // A value at which the parameter does something.
  static double Moved(const OwnParameter& p);

 protected:
  explicit OwnProbe(const OwnEffect& own) : own_(own) {}
  const OwnEffect& own_;
};

// What enters the structure, by the names of the parameters.
Structure::OwnTorque TorqueOf(const OwnEffect& own, const std::map<std::string, std::string>& names);

// The candidate, which must have been read without error, must outlive it.
std::unique_ptr<OwnProbe> MakeFormulaProbe(const OwnEffect& own, const Experiment& experiment);
// Error: the plugin is not registered, is not passive, or refuses the model. What it throws is thrown.
Result<std::unique_ptr<OwnProbe>> MakePluginProbe(const OwnEffect& own, const Rig& rig);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_OWN_PROBE_H_
