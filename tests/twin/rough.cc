#include "tests/twin/rough.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>

namespace gapscope::twin {
namespace {

constexpr double kSmoothSign = 0.1;            // of the speed's deviation
constexpr double kSame = 1e-3;                 // laws whose difference is less over the motion count as one
constexpr double kMostHeld = 0.5;              // by one law, of the torque's square
constexpr double kLeastLeft = 0.15;            // of the waves, once the laws are out
constexpr double kAngle = 1.6, kSpeed = 1.1;   // deviations of the waves' numbers
constexpr double kMemory = 0.3, kDrift = 0.2;  // shares of the torques
constexpr double kSizing_s = 5e-4, kSample_s = 0.005;
constexpr int kDraws = 40, kRounds = 6;

double SmoothSign(const Rough& r, double speed) { return speed / std::hypot(speed, kSmoothSign * r.speed_rad_per_s); }

std::array<double, Rough::kLaws> Laws(const Rough& r, double angle, double speed) {
  const double x = (angle - r.middle_rad) / r.angle_rad, v = speed / r.speed_rad_per_s;
  return {1, x, std::sin(angle), std::cos(angle), SmoothSign(r, speed), v, v * std::abs(v)};
}

Eigen::MatrixXd LawColumns(const Rough& r, const JointMotion& m) {
  Eigen::MatrixXd columns(static_cast<Eigen::Index>(m.angle_rad.size()), Rough::kLaws);
  for (std::size_t i = 0; i < m.angle_rad.size(); ++i) {
    const auto laws = Laws(r, m.angle_rad[i], m.speed_rad_per_s[i]);
    for (int k = 0; k < Rough::kLaws; ++k) columns(static_cast<Eigen::Index>(i), k) = laws[k];
  }
  return columns;
}

Eigen::VectorXd WavesAlong(const Rough& r, const JointMotion& m) {
  Eigen::VectorXd waves(static_cast<Eigen::Index>(m.angle_rad.size()));
  double seen = 0;
  for (std::size_t i = 0; i < m.angle_rad.size(); ++i) {
    const bool begins = std::find(m.begins.begin(), m.begins.end(), i) != m.begins.end();
    seen = begins ? m.angle_rad[i] : Remembered(r, seen, m.angle_rad[i]);
    waves[static_cast<Eigen::Index>(i)] = Waves(r, seen, m.speed_rad_per_s[i], m.session_s[i]);
  }
  return waves;
}

// The columns' span in orthonormal directions, those left out in which the columns hardly differ from nothing:
// columns * weights.
Eigen::MatrixXd SpanWeights(const Eigen::MatrixXd& columns) {
  const Eigen::VectorXd size = columns.colwise().norm().cwiseMax(1e-12);
  const Eigen::MatrixXd unit = columns * size.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(unit.transpose() * unit);
  const Eigen::VectorXd& values = eigen.eigenvalues();  // rising
  const Eigen::Index kept = (values.array() > kSame * kSame * values.maxCoeff()).count();
  return size.cwiseInverse().asDiagonal() * eigen.eigenvectors().rightCols(kept) *
         values.tail(kept).cwiseSqrt().cwiseInverse().asDiagonal();
}

// Share of `rest` that the law's columns hold beside the span that is out of it.
double ShareHeld(Eigen::MatrixXd law, const Eigen::MatrixXd& span, const Eigen::VectorXd& rest) {
  const Eigen::VectorXd before = law.colwise().norm();
  law -= span * (span.transpose() * law);
  if ((law.colwise().norm().transpose().array() < kSame * before.array()).all()) return 0;
  return (SpanWeights(law).transpose() * (law.transpose() * rest)).squaredNorm() / std::max(rest.squaredNorm(), 1e-300);
}

void DrawTerms(RoughKind kind, double drift_hz, Random* random, Rough* rough) {
  rough->terms.clear();
  const int terms = random->Integer(3, 6);
  for (int i = 0; i < terms; ++i) {
    RoughTerm t = DrawTerm(kind, random);
    t.amplitude = random->Uniform(0.5, 1.5);
    if (drift_hz > 0) {
      t.drift_hz = drift_hz;
      t.swing = random->Uniform(0.2, 0.8);
      t.swing_phase_rad = random->Uniform(0, kTurn);
      t.wander_rad = random->Uniform(0, 0.8);
      t.wander_phase_rad = random->Uniform(0, kTurn);
    }
    rough->terms.push_back(t);
  }
}

}  // namespace

double Waves(const Rough& rough, double seen_rad, double speed_rad_per_s, double session_s) {
  const double x = (seen_rad - rough.middle_rad) / rough.angle_rad, v = speed_rad_per_s / rough.speed_rad_per_s;
  double sum = 0;
  for (const RoughTerm& t : rough.terms) {
    double amplitude = t.amplitude, phase = t.angle * x + t.speed * v + t.phase_rad;
    if (t.drift_hz > 0) {
      const double turn = kTurn * t.drift_hz * session_s;
      amplitude *= 1 + t.swing * std::sin(turn + t.swing_phase_rad);
      phase += t.wander_rad * std::sin(turn + t.wander_phase_rad);
    }
    sum += amplitude * std::sin(phase);
  }
  return sum;
}

double Held(const Rough& rough, double angle_rad, double speed_rad_per_s) {
  const auto laws = Laws(rough, angle_rad, speed_rad_per_s);
  double sum = 0;
  for (std::size_t k = 0; k < laws.size(); ++k) sum += rough.laws[k] * laws[k];
  return sum;
}

double Remembered(const Rough& rough, double before_rad, double angle_rad) {
  const double half = rough.memory_rad / 2;
  return std::clamp(before_rad, angle_rad - half, angle_rad + half);
}

double RoughTorque(const Rough& rough, double before_rad, const AngleAndSpeed& now, double session_s) {
  const double seen = Remembered(rough, before_rad, now.angle_rad);
  return rough.scale_n_m *
         (Waves(rough, seen, now.speed_rad_per_s, session_s) - Held(rough, now.angle_rad, now.speed_rad_per_s));
}

std::array<JointMotion, 2> JointMotions(const Plant& plant, const std::vector<LogSpec>& logs) {
  RecordOptions options;
  options.step_s = kSizing_s;
  options.noise = false;
  std::array<JointMotion, 2> motions;
  for (const LogSpec& log : logs) {
    const Record record = MakeRecord(plant, log, Sensors{}, options);
    for (JointMotion& m : motions) m.begins.push_back(m.angle_rad.size());
    double next = 0;
    for (std::size_t i = 0; i < record.time_s.size(); ++i) {
      if (record.time_s[i] + 1e-9 < next) continue;
      next = record.time_s[i] + kSample_s;
      for (std::size_t j = 0; j < 2; ++j) {
        motions[j].session_s.push_back(log.session_s + record.time_s[i]);
        motions[j].angle_rad.push_back(record.motion[i][2 * j]);
        motions[j].speed_rad_per_s.push_back(record.motion[i][2 * j + 1]);
      }
      motions[0].drive_n_m.push_back(record.drive[i].torque_n_m);
    }
  }
  return motions;
}

std::vector<double> Along(const Rough& rough, const JointMotion& motion) {
  const Eigen::VectorXd rest =
      WavesAlong(rough, motion) -
      LawColumns(rough, motion) * Eigen::Map<const Eigen::VectorXd>(rough.laws.data(), Rough::kLaws);
  return {rest.data(), rest.data() + rest.size()};
}

double RootMeanSquare(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / std::max<double>(1, static_cast<double>(values.size())));
}

void TakeOutLaws(const JointMotion& motion, Rough* rough) {
  const Eigen::MatrixXd columns = LawColumns(*rough, motion);
  const Eigen::VectorXd waves = WavesAlong(*rough, motion);
  if (!columns.allFinite() || !waves.allFinite()) return;  // carried away: such a plant is not kept
  const Eigen::MatrixXd weights = SpanWeights(columns);
  const Eigen::VectorXd held = weights * (weights.transpose() * (columns.transpose() * waves));
  if (held.allFinite()) std::copy(held.data(), held.data() + held.size(), rough->laws.begin());
}

Hold LargestHold(const Rough& rough, const JointMotion& m) {
  const auto rows = static_cast<Eigen::Index>(m.angle_rad.size());
  const std::vector<double> along = Along(rough, m);
  const Eigen::Map<const Eigen::VectorXd> rest(along.data(), rows);
  const Eigen::MatrixXd laws = LawColumns(rough, m), span = laws * SpanWeights(laws);
  Hold most;
  using Column = std::function<double(std::size_t)>;
  const auto test = [&](const std::string& law, const std::vector<Column>& parts) {
    Eigen::MatrixXd columns(rows, static_cast<Eigen::Index>(parts.size()));
    for (Eigen::Index i = 0; i < rows; ++i) {
      for (std::size_t k = 0; k < parts.size(); ++k) {
        columns(i, static_cast<Eigen::Index>(k)) = parts[k](static_cast<std::size_t>(i));
      }
    }
    const double share = ShareHeld(columns, span, rest);
    if (share > most.share) most = {law, share};
  };
  const auto x = [&](std::size_t i) { return (m.angle_rad[i] - rough.middle_rad) / rough.angle_rad; };
  const auto sign = [&](std::size_t i) { return SmoothSign(rough, m.speed_rad_per_s[i]); };

  // Cubic springs whatever their rest, friction that falls with speed, ripples of any number of periods.
  test("cubic spring", {[&](std::size_t i) { return x(i) * x(i); }, [&](std::size_t i) { return x(i) * x(i) * x(i); }});
  for (const double part : {0.1, 0.2, 0.4}) {
    test("stribeck", {[&, part](std::size_t i) {
           const double ratio = m.speed_rad_per_s[i] / (part * rough.speed_rad_per_s);
           return sign(i) * std::exp(-ratio * ratio);
         }});
  }
  for (int periods = 2; periods <= 40; ++periods) {
    test("cogging", {[&, periods](std::size_t i) { return std::sin(periods * m.angle_rad[i]); },
                     [&, periods](std::size_t i) { return std::cos(periods * m.angle_rad[i]); }});
  }
  if (m.drive_n_m.empty()) return most;
  // What goes with the drive's torque: gain, droop, gain by direction, friction by load, a delay.
  const auto drive = [&](std::size_t i) { return m.drive_n_m[i]; };
  test("gain", {drive});
  test("droop", {[&](std::size_t i) { return drive(i) * std::abs(drive(i)); }});
  test("gain by direction", {[&](std::size_t i) { return std::abs(drive(i)); }});
  test("friction by load", {[&](std::size_t i) { return std::abs(drive(i)) * sign(i); }});
  test("delay", {[&](std::size_t i) {
         return i > 0 && m.session_s[i] - m.session_s[i - 1] < 0.1 ? drive(i) - drive(i - 1) : 0.0;
       }});
  return most;
}

const char* RoughKindName(RoughKind kind) {
  return kind == RoughKind::kAngle ? "angle" : kind == RoughKind::kSpeed ? "speed" : "both";
}

RoughKind KindOf(const Rough& rough) {
  const auto none = [&](double RoughTerm::* part) {
    return std::all_of(rough.terms.begin(), rough.terms.end(), [&](const RoughTerm& t) { return t.*part == 0; });
  };
  return none(&RoughTerm::speed) ? RoughKind::kAngle : none(&RoughTerm::angle) ? RoughKind::kSpeed : RoughKind::kBoth;
}

RoughTerm DrawTerm(RoughKind kind, Random* random) {
  RoughTerm t;
  t.amplitude = 1;
  const double angle = kAngle * random->Normal(), speed = kSpeed * random->Normal();
  t.angle = kind == RoughKind::kSpeed ? 0 : angle;
  t.speed = kind == RoughKind::kAngle ? 0 : speed;
  t.phase_rad = random->Uniform(0, kTurn);
  return t;
}

Rough DrawRough(const JointMotion& motion, double rms_n_m, Random* random) {
  Rough rough;
  const auto count = static_cast<double>(motion.angle_rad.size());
  for (const double q : motion.angle_rad) rough.middle_rad += q / count;
  std::vector<double> about = motion.angle_rad;
  for (double& q : about) q -= rough.middle_rad;
  rough.angle_rad = std::max(RootMeanSquare(about), 1e-6);
  rough.speed_rad_per_s = std::max(RootMeanSquare(motion.speed_rad_per_s), 1e-6);

  Rough best;
  double least = 2;
  for (int round = 0; round < kRounds && least > kMostHeld; ++round) {
    const RoughKind kind = static_cast<RoughKind>(random->Integer(0, 2));
    const double drift_hz = random->Chance(kDrift) ? 1 / random->LogUniform(20, 80) : 0;
    const bool remembers = random->Chance(kMemory) && kind != RoughKind::kSpeed;
    rough.memory_rad = remembers ? rough.angle_rad * random->Uniform(0.2, 0.8) : 0;
    for (int draw = 0; draw < kDraws && least > kMostHeld; ++draw) {
      DrawTerms(kind, drift_hz, random, &rough);
      rough.laws = {};
      const double whole = RootMeanSquare(Along(rough, motion));
      TakeOutLaws(motion, &rough);
      const double left = RootMeanSquare(Along(rough, motion));
      if (left < kLeastLeft * whole) continue;
      const double held = LargestHold(rough, motion).share;
      if (held >= least) continue;
      least = held;
      best = rough;
      best.scale_n_m = rms_n_m / left;
    }
  }
  return best;
}

}  // namespace gapscope::twin
