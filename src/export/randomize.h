// A tuned model's uncertainty as domain randomisation: which numbers of the MJCF vary, in which ranges, and joint draws
// of them.
#ifndef GAPSCOPE_EXPORT_RANDOMIZE_H_
#define GAPSCOPE_EXPORT_RANDOMIZE_H_

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "src/core/enum_names.h"
#include "src/model/model.h"

namespace gapscope {

// What draws are of.
enum class DrawsFrom {
  kCovariance,  // what one fit leaves open: normal
  kInterval,    // the same, but each parameter uniform within its 95 % interval, their ranks correlated as the fit's
  kLogs,        // how logs differ: normal, by the mean and the covariance of the fits to each log alone
  kFits,        // those fits themselves, in turn
};
template <>
std::span<const EnumName<DrawsFrom>> EnumNames<DrawsFrom>();  // "covariance", "interval", "logs", "fits"

// A parameter that varies, at its best value. Its deviation and correlations: UncertainParameters::covariance.
struct UncertainParameter {
  int index = -1;            // in Model::parameters()
  bool logarithmic = false;  // the covariance is of ln |value|
  bool together = false;     // correlated so much with another one that its range holds with the others as they are
};
struct UncertainParameters {
  std::vector<UncertainParameter> parameters;
  Eigen::MatrixXd covariance;
  DrawsFrom from = DrawsFrom::kCovariance;
  Eigen::MatrixXd fits = {};  // of kFits: parameters x fits, off the best values in the covariance's coordinates
};

// An array beside mjModel's: ExportedModel::delay_steps, a row per drive in its order.
inline constexpr char kDelaySteps[] = "delay_steps";
// Numbers of ExportedModel::laws, in the order of drives and of arguments.
inline constexpr char kLaws[] = "laws";

// One number of an array of mjModel ("dof_damping", "opt.gravity") at both ends of a parameter's range.
struct VaryingNumber {
  std::string field;
  std::size_t row = 0, column = 0;
  double value = 0, low = 0, high = 0;
};
struct ParameterRange {
  std::string name, unit;
  double value = 0, low = 0, high = 0;  // 95 %
  bool conditional = false;             // with the others as they are
  std::vector<VaryingNumber> numbers;   // empty: the MJCF has none; the host does it
};

// An array of mjModel of which some number varies, for each draw.
struct DrawnField {
  std::string name;
  std::vector<std::size_t> shape;  // draws, rows, and columns where there is more than one
  std::vector<double> values;
};
struct Randomization {
  std::vector<ParameterRange> ranges;
  std::vector<DrawnField> fields;
  std::vector<double> drawn;  // draws x parameters, in the order of `ranges`
};

// Null: nothing of it varies.
const DrawnField* FieldOf(const Randomization& randomization, const std::string& name);

// Whether a parameter may be drawn without the others: it goes together with none, and makes one number that no other
// makes.
bool MayBeDrawnAlone(const ParameterRange& range, const std::vector<ParameterRange>& all);

// The steps that a drive's commands may be late, where a parameter says so that may be drawn alone; else both
// `nominal`.
struct DelayRange {
  double low = 0, high = 0;
};
DelayRange RangeOfDelay(const Randomization& randomization, std::size_t drive, double nominal);

// The MJCF with these values of all parameters.
using MakeExport = std::function<Result<ExportedModel>(std::span<const double>)>;

// `draws` of what `uncertain` says that they are from, kept within the parameters' bounds; of an effect's torques,
// whose bounds depend on the rig's size, zero alone is one. The same seed gives the same draws. What follows from other
// numbers (inverse weights, lengths) varies with them in `fields` and is not told in `ranges`. Errors: as `make`; a
// draw whose MJCF has other elements.
Result<Randomization> Randomize(const Model& model, std::span<const double> values,
                                const UncertainParameters& uncertain, const MakeExport& make, std::size_t draws,
                                std::uint64_t seed);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPORT_RANDOMIZE_H_
