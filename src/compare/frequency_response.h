// How a signal answers a command over frequency, as measured and as predicted.
#ifndef GAPSCOPE_COMPARE_FREQUENCY_RESPONSE_H_
#define GAPSCOPE_COMPARE_FREQUENCY_RESPONSE_H_

#include <span>
#include <vector>

namespace gapscope {

struct ResponsePoint {
  double hz = 0;
  double measured_gain = 0, predicted_gain = 0;            // signal's unit per command's unit
  double measured_phase_deg = 0, predicted_phase_deg = 0;  // unwrapped from the lowest frequency on
  double coherence = 0;                                    // of measured with command, squared; 0..1
};

// H = S_uy / S_uu by Welch's method (Hann windows overlapping by half, the log's slope and each one's mean removed;
// eight segments to the log), averaged over bands of a fifth of an octave. Only bands where the command has power
// (above 1e-3 of its largest band) and its square coherence with the measured signal is at least 0.5 are given. Under
// feedback H is biased towards the inverse of the controller, equally for both. Rows are taken as the median step
// apart, gaps bridged. Empty below 256 rows, for a constant command or without a prediction.
std::vector<ResponsePoint> EstimateResponse(std::span<const double> time_s, std::span<const double> command,
                                            std::span<const double> measured, std::span<const double> predicted);

}  // namespace gapscope

#endif  // GAPSCOPE_COMPARE_FREQUENCY_RESPONSE_H_
