// Random numbers of the twin plant: the same seed gives the same bytes on every platform. mt19937_64 is fixed by the
// standard, the library's distributions are not, so the few that are needed stand here.
#ifndef GAPSCOPE_TESTS_TWIN_RANDOM_H_
#define GAPSCOPE_TESTS_TWIN_RANDOM_H_

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string_view>

namespace gapscope::twin {

class Random {
 public:
  // One independent stream per purpose ("noise", "base", ...) of a case, so that a change of one draw leaves the
  // others.
  Random(std::uint64_t seed, std::uint64_t index, std::string_view purpose) {
    std::uint64_t h = Mix(seed + 0x9e3779b97f4a7c15ULL) ^ Mix(index + 0xbf58476d1ce4e5b9ULL);
    for (const char c : purpose) h = Mix(h ^ static_cast<unsigned char>(c));
    engine_.seed(h);
  }
  // Uniform in [0, 1), 53 bits.
  double Unit() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  double Uniform(double low, double high) { return low + (high - low) * Unit(); }
  double LogUniform(double low, double high) { return low * std::pow(high / low, Unit()); }
  int Integer(int low, int high) { return low + static_cast<int>(Unit() * (high - low + 1)); }  // both ends included
  bool Chance(double probability) { return Unit() < probability; }
  double Sign() { return Chance(0.5) ? 1.0 : -1.0; }
  // Standard normal (Box-Muller; the second value is not kept, so that one call is always two draws).
  double Normal() {
    const double u = 1.0 - Unit(), v = Unit();
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
  }

 private:
  static std::uint64_t Mix(std::uint64_t z) {  // splitmix64
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  std::mt19937_64 engine_;
};

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_RANDOM_H_
