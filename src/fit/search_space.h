// The parameters that a fit moves, as coordinates of similar size: logarithms, scales, and pairs of parameters that act
// linearly together.
#ifndef GAPSCOPE_FIT_SEARCH_SPACE_H_
#define GAPSCOPE_FIT_SEARCH_SPACE_H_

#include <Eigen/Core>
#include <vector>

#include "src/experiment/experiment.h"

namespace gapscope {

// A parameter in search coordinates: logarithmic where its lower bound is positive (or asked for:
// FitOptions::logarithmic_effects), else in units of `scale`.
struct Coordinate {
  int parameter = 0;
  bool logarithmic = false;
  double scale = 1, low = 0, high = 0;  // bounds in search coordinates; logarithmic: scale is the sign, +-1
  double ToSearch(double value) const;  // logarithmic: what is zero or of the other sign becomes a very small number
  double ToValue(double search) const;
};

class SearchSpace {
 public:
  // `free`: indices in `parameters`, which must outlive the space. `values`: all parameters, where the search starts;
  // bounds grow to hold that.
  SearchSpace(const std::vector<Parameter>& parameters, const std::vector<int>& free, std::vector<double> values,
              bool logarithmic_effects, bool linear_terms);

  const std::vector<Coordinate>& coordinates() const { return coordinates_; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(coordinates_.size()); }
  const Eigen::VectorXd& low() const { return low_; }
  const Eigen::VectorXd& high() const { return high_; }
  const std::vector<double>& start() const { return values_; }
  const Parameter& parameter(const Coordinate& c) const { return parameters_[static_cast<std::size_t>(c.parameter)]; }

  // All parameters' values at y, of which the first size() numbers are read.
  std::vector<double> Values(const Eigen::VectorXd& y) const;
  // size() numbers, inside the bounds.
  Eigen::VectorXd ToSearch(const std::vector<double>& values) const;
  // Writes the values of coordinate i, and of those that it is coupled with, at y with `moved` in the place of y[i].
  void SetCoordinate(const Eigen::VectorXd& y, Eigen::Index i, double moved, std::vector<double>* values) const;
  // Two coordinates that give two parameters together (Parameter::with). A rest that a cubic shares is searched times
  // the stiffness of both at the rig's own angle: times the size alone it would be lost where that is zero.
  struct Couple {
    Eigen::Index size, other;
    Parameter::With with;
    int cubic = -1;                 // parameter; -1: none
    Eigen::Index cubic_place = -1;  // its coordinate; -1: it is held
  };
  const std::vector<Couple>& couples() const { return couples_; }

 private:
  void CoupleTerms();
  void FindCubic(Couple* couple) const;
  // Of a size and its cubic together, in the size's unit.
  double Stiffness(const Couple& couple, const std::vector<double>& values) const;
  void SetCouple(const Couple& couple, double size, double other, std::vector<double>* values) const;

  const std::vector<Parameter>& parameters_;
  std::vector<double> values_;
  std::vector<Coordinate> coordinates_;
  std::vector<Couple> couples_;
  Eigen::VectorXd low_, high_;
};

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_SEARCH_SPACE_H_
