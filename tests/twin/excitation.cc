#include "tests/twin/excitation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace gapscope::twin {
namespace {

constexpr std::array<std::pair<Shape, const char*>, 9> kNames = {{{Shape::kZero, "zero"},
                                                                  {Shape::kChirp, "chirp"},
                                                                  {Shape::kMultisine, "multisine"},
                                                                  {Shape::kSteps, "steps"},
                                                                  {Shape::kTriangle, "triangle"},
                                                                  {Shape::kSquare, "square"},
                                                                  {Shape::kRamps, "ramps"},
                                                                  {Shape::kSwept, "swept"},
                                                                  {Shape::kConstant, "constant"}}};

double Fraction(double x) { return x - std::floor(x); }

// Levels held for random times; alternating sides keep an integrating plant near its start.
void DrawLevels(double shortest_s, double longest_s, Excitation* e, Random* random) {
  double t = random->Uniform(0.1, 0.3), side = random->Sign();
  e->until_s.push_back(t);
  e->level.push_back(0);
  while (t < e->duration_s) {
    t += random->Uniform(shortest_s, longest_s);
    e->until_s.push_back(t);
    e->level.push_back(side * random->Uniform(0.2, 1.0));
    side = random->Chance(0.8) ? -side : side;
  }
}

}  // namespace

const char* ShapeName(Shape shape) {
  for (const auto& [value, name] : kNames) {
    if (value == shape) return name;
  }
  return "";
}

bool ParseShape(std::string_view name, Shape* shape) {
  for (const auto& [value, text] : kNames) {
    if (name == text) {
      *shape = value;
      return true;
    }
  }
  return false;
}

Excitation MakeExcitation(Shape shape, double duration_s, double low_hz, double high_hz, Random* random) {
  Excitation e;
  e.shape = shape;
  e.duration_s = duration_s;
  e.low_hz = low_hz;
  e.high_hz = high_hz;
  switch (shape) {
    case Shape::kChirp:
      e.envelope = random->Chance(0.5) ? 0.0 : random->Uniform(0.3, 1.2);
      break;
    case Shape::kMultisine: {
      const int tones = random->Integer(8, 16);
      double power = 0;
      for (int i = 0; i < tones; ++i) {
        e.hz.push_back(random->LogUniform(low_hz, high_hz));
        e.amplitude.push_back(random->Uniform(0.4, 1.0));
        e.phase_rad.push_back(random->Uniform(0, kTurn));
        power += e.amplitude.back() * e.amplitude.back();
      }
      for (double& a : e.amplitude) a /= std::sqrt(2 * power);  // RMS of one half
      break;
    }
    case Shape::kSteps:
      DrawLevels(0.4, 1.2, &e, random);
      break;
    case Shape::kRamps:
      DrawLevels(0.6, 1.6, &e, random);
      break;
    case Shape::kTriangle:
    case Shape::kSquare:
    case Shape::kSwept:
      e.low_hz = random->LogUniform(low_hz, std::min(high_hz, 6 * low_hz));
      e.growth = shape == Shape::kSwept ? 0.95 : random->Chance(0.4) ? 0.8 : 0.0;
      break;
    default:
      break;
  }
  return e;
}

double Excitation::At(double time_s) const {
  const double grown = 1 - growth * (1 - time_s / duration_s);
  const double cycle = low_hz * time_s + phase;
  switch (shape) {
    case Shape::kZero:
      return 0;
    case Shape::kConstant:
      return 1;
    case Shape::kChirp: {
      const double rate = (high_hz - low_hz) / duration_s;
      const double now_hz = low_hz + rate * time_s;
      return std::pow(now_hz / high_hz, envelope) *
             std::sin(kTurn * (phase + low_hz * time_s + rate * time_s * time_s / 2));
    }
    case Shape::kMultisine: {
      // Faded in, so that the first command is no jump.
      double sum = 0;
      for (std::size_t i = 0; i < hz.size(); ++i) sum += amplitude[i] * std::sin(kTurn * hz[i] * time_s + phase_rad[i]);
      return sum * std::min(1.0, time_s / 0.2);
    }
    case Shape::kTriangle:
      return grown * (4 * std::abs(Fraction(cycle + 0.75) - 0.5) - 1);
    case Shape::kSquare:
      return grown * (Fraction(cycle) < 0.5 ? 1 : -1);
    case Shape::kSwept:
      return grown * std::sin(kTurn * cycle);
    case Shape::kSteps:
    case Shape::kRamps: {
      const auto at = std::upper_bound(until_s.begin(), until_s.end(), time_s) - until_s.begin();
      const std::size_t i = std::min(static_cast<std::size_t>(at), level.size() - 1);
      if (shape == Shape::kSteps || i == 0) return level[i];
      const double part = (time_s - until_s[i - 1]) / (until_s[i] - until_s[i - 1]);
      return level[i - 1] + std::min(part, 1.0) * (level[i] - level[i - 1]);
    }
  }
  return 0;
}

}  // namespace gapscope::twin
