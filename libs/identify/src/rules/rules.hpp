#pragma once
#include <array>
#include <limits>
#include <string_view>

/// All thresholds that decide what `identify` and `validate` claim: which terms stand in a model, what is warned of,
/// refused, trusted or said to be open. Each has its statistic, the chance of a false alarm with the number of tests
/// that the chance is for, and its source. What only steers a computation (steps, counts of trials, starts) stays where
/// it is used.
///
/// One scale of chi-square for models of every kind: what is left of the readings, or of the whitened weak equations,
/// by the noise, both squared and per degree of freedom; 1 where the model fits. One scale of evidence: twice the fall
/// of the negative logarithm of the likelihood, which is chi-square of one degree of freedom for a needless parameter.
namespace whirl::identification::rules {

/// How the chance of a false alarm is known.
enum class Basis {
  law,      ///< it follows from the limit and a chi-square of `freedom`: rules_test computes it
  counted,  ///< of `tests` machines without what is alarmed of, by the command in `source`
  meaning,  ///< no chance of an alarm by noise: it follows from what it means, as `source` says
  assumed,  ///< chosen; `source` says what for
};

struct Rule {
  double limit;
  std::string_view statistic;
  Basis basis;
  double chance;  ///< of a false alarm of one test, or of one machine; NaN: neither law nor count
  double tests;   ///< law: that one verdict makes, each with that chance; counted: machines
  double freedom = 1;
  double power = 1;  ///< of the limit that is chi-square: 2 where it counts standard deviations
  std::string_view source;
  constexpr operator double() const { return limit; }  // NOLINT: it stands for its limit
};

namespace make {
constexpr Rule evidence(double limit, double chance, std::string_view statistic, std::string_view source) {
  return {limit, statistic, Basis::law, chance, 1, 1, 1, source};
}
constexpr Rule deviations(double limit, double chance, std::string_view statistic, std::string_view source,
                          double freedom = 1) {
  return {limit, statistic, Basis::law, chance, 1, freedom, 2, source};
}
constexpr Rule counted(double limit, int alarms, int machines, std::string_view statistic, std::string_view source) {
  return {limit, statistic, Basis::counted, static_cast<double>(alarms) / machines, static_cast<double>(machines),
          1,     1,         source};
}
constexpr Rule meaning(double limit, std::string_view statistic, std::string_view source) {
  return {limit, statistic, Basis::meaning, std::numeric_limits<double>::quiet_NaN(), 0, 1, 1, source};
}
constexpr Rule assumed(double limit, std::string_view statistic, std::string_view what_for) {
  return {limit, statistic, Basis::assumed, std::numeric_limits<double>::quiet_NaN(), 0, 1, 1, what_for};
}
}  // namespace make

inline constexpr double k95 = 1.959963984540054;  ///< standard deviations to either end of a 95 % interval

inline namespace of_chi_square {

// Chi-square of what is left. Of n readings it deviates by sqrt(2/n), and the noise is known to a tenth in variance
// (record_noise.cpp).
inline constexpr Rule kModelError =
    make::counted(1.3, 0, 400, "chi-square: something is missing, intervals are widened",
                  "bench_identify_rules 200 60001 20 and 40: rotors of the plain model");
inline constexpr Rule kNoTrust = make::counted(2, 0, 400, "chi-square: what is missing is as large as the noise",
                                               "bench_identify_rules 200 60001 20 and 40: rotors of the plain model");
inline constexpr Rule kAnotherModel = make::meaning(4, "chi-square: so large that every absent term shows a sign of it",
                                                    "what is missing is three times the noise");
inline constexpr Rule kAngleUnknown =
    make::assumed(1.5, "chi-square with an angle read from the vibration: it is not that angle",
                  "between kModelError and kNoTrust: no machine keeps to a polynomial of the speed");
inline constexpr Rule kMayBeColoured = make::assumed(1.2, "chi-square: noise correlated from sample to sample is tried",
                                                     "twice what a tenth of the noise's variance is");
inline constexpr Rule kHeldOutScatter = make::meaning(1.3 * 1.3, "chi-square of a part held out: not more than noise",
                                                      "1.3 in rms: part and noise are estimates of few samples");
inline constexpr Rule kHeldOutMore =
    make::meaning(4, "chi-square of a part held out: more than noise", "2 in rms, as the band of validate");
inline constexpr Rule kLagLeft = make::assumed(1.05 * 1.05, "chi-square: nothing is left for the lag of an actuator",
                                               "1.05 in rms, half of what the noise is known to");
inline constexpr Rule kMostlyNoise = make::meaning(1.2 * 1.2, "chi-square of a channel as it is: hardly motion",
                                                   "1.2 in rms: the motion is less than 0.7 of the noise");

}  // namespace of_chi_square

inline namespace of_evidence {

// Evidence.
inline constexpr Rule kTerm =
    make::evidence(16, 6.33e-5, "score or likelihood ratio of a term", "4 deviations; RotorIdentifyOptions");
inline constexpr double kUsualTests = 16;  ///< forces, sensor axes, modes above the speeds: so many chances to be wrong
inline constexpr double kRareTests = 19;   ///< parameters of the rare terms, beside them
inline constexpr Rule kOfSearch =
    make::meaning(3, "times kTerm: a mode found by search, a disc that tilts",
                  "its frequency and damping are chosen among all: the level of 4 deviations over 1e7 tests");
inline constexpr Rule kToldApart =
    make::evidence(9, 2.70e-3, "likelihood ratio of two models, also of two holds of an input", "3 deviations");
inline constexpr Rule kHint{10.8,
                            "score of an absent term that is worth a word",
                            Basis::law,
                            1.02e-3,
                            kUsualTests + kRareTests,
                            1,
                            1,
                            "a thousandth, and kToldApart by the likelihood: of bench_identify_rules 200 60001 3 plain "
                            "rotors have one at 20 dB, 3 at 40"};
inline constexpr Rule kOdds20 =
    make::meaning(6, "criterion of two models: channels moved in time, another reading of a record",
                  "odds of 20 to 1, Kass and Raftery 1995");
inline constexpr Rule kOdds150 =
    make::meaning(10, "criterion of two sets of terms: distinguished", "odds of 150 to 1, Kass and Raftery 1995");
inline constexpr Rule kColoured =
    make::evidence(12, 5.32e-4, "likelihood ratio of noise with a colour, beside its price",
                   "3.5 deviations; Schwarz 1978 for the price");
inline constexpr Rule kHiddenTerm =
    make::evidence(25, 5.73e-7, "score of a term beside a hidden state", "5 deviations");

}  // namespace of_evidence

inline namespace of_deviations {

// Standard deviations.
inline constexpr Rule kImpossible =
    make::deviations(3, 2.70e-3, "moments of inertia beyond those of any disc", "both ends together");
inline constexpr Rule kVectorSeen = make::deviations(3, 1.11e-2, "runout or slow roll: a vector, by its deviation",
                                                     "two components: chi-square of 2", 2);
inline constexpr Rule kRestDiffers = make::deviations(
    4, 6.33e-5, "a parameter by all records from that without the part held out", "the level of kTerm");
inline constexpr Rule kRecordsDiffer =
    make::deviations(5, 5.73e-7, "k1 or c of one record from that of the first, by the weak equations",
                     "deviations of the weak equations are asymptotic: one more than kTerm");
inline constexpr Rule kAxesToldApart =
    make::deviations(5, 5.73e-7, "cubic springs along the axes from a radial one", "else both readings are stated");
inline constexpr Rule kBand =
    make::deviations(2, 4.55e-2, "error of a run by what noise and parameters move it", "95 %");

}  // namespace of_deviations

inline namespace of_parts {

// Parts of the records, and what is left of the noise.
inline constexpr Rule kPartsDiffer{
    1e-6, "chance of as much between parts that are alike (F test)",         Basis::law, 1e-6, 3, 1,
    0,    "stated of the whole: records, halves and eighths are three tests"};
inline constexpr Rule kNotWhite{1e-4,       "chance of as much scatter inside parts by white noise",
                                Basis::law, 1e-4,
                                3,          1,
                                0,          "intervals are widened, nothing is withdrawn"};
inline constexpr Rule kWhiteLeft{
    1e-4, "chance of as much autocorrelation of white noise", Basis::law, 1e-4, 1, 1, 0, "Box and Pierce 1970"};
inline constexpr Rule kNoiseKnown = make::meaning(
    0.25, "logarithm of chi-square of a state", "the variance of the noise is known to a tenth: two and a half of it");
inline constexpr Rule kColourLeast = make::meaning(0.2, "correlation of noise from one sample to the next",
                                                   "below it intervals move by less than a quarter");
inline constexpr Rule kColourAlike = make::assumed(0.3, "autocorrelation beside that of noise of first order",
                                                   "larger: motion that is left, not such noise");

}  // namespace of_parts

inline namespace of_shares {

// Shares that matter to a user.
inline constexpr Rule kUnexplained =
    make::assumed(0.15, "rms of what free runs leave beyond the noise, by the motion: unusable",
                  "a seventh of the motion is another curve");
inline constexpr Rule kLost =
    make::assumed(0.5, "the same of a prediction or a left-hand side: none", "half of the motion");
inline constexpr Rule kHeldOutSeen =
    make::assumed(0.02, "the same of a part held out: worth a word", "less is seen in no plot");
inline constexpr Rule kSlight = make::assumed(1e-3, "the same of its own records: no reason to distrust a model",
                                              "a twentieth of kHeldOutSeen, the limit of a prediction");
inline constexpr Rule kRegressionPoor = make::assumed(0.1, "the same of a left-hand side by regression alone",
                                                      "noise of a column biases by its square, a hundredth");
inline constexpr Rule kSpringOpen =
    make::meaning(0.05, "deviation of k1 by its value", "its 95 % interval is a critical speed to 5 %");
inline constexpr Rule kUnbalanceOpen = make::meaning(0.5, "deviation of e by its value", "its 95 % interval holds 0");
inline constexpr Rule kPartsMatter = make::assumed(0.01, "difference of a coefficient between parts",
                                                   "a difference that is sure and below 1 % is no finding");
inline constexpr Rule kRestMatters = make::assumed(
    1e-3, "difference of a parameter from that without the part held out", "a sure difference below it is none");
inline constexpr Rule kRecordsMatter =
    make::assumed(1e-4, "difference of k1 or c between records", "below it no spring is given to each");
inline constexpr Rule kExplainsLeast = make::assumed(0.01, "share of what is missing that one more term takes",
                                                     "of much that is missing any term takes a little");
inline constexpr Rule kHalf = make::assumed(0.5, "chi-square that a richer model leaves, by that of the simpler one",
                                            "a model that explains neither must explain more");
inline constexpr Rule kRunShare =
    make::assumed(0.03, "error of a validated run, by its motion: within its band", "less is seen in no plot");
inline constexpr Rule kRunOpen =
    make::assumed(0.25, "what noise and intervals move a whole run, by its motion: it says nothing",
                  "a free run that is moved by so much tests nothing");
inline constexpr Rule kDriveAngle =
    make::assumed(0.05, "error of the angle, by the turns made", "the torque is then wrong by as much");

inline constexpr Rule kHiddenGain =
    make::assumed(0.9, "error of the part held out with a hidden state, by that without", "a tenth pays for a state");
inline constexpr Rule kHiddenTermGain =
    make::assumed(0.97, "the same with one more term", "five terms of such a gain are a state's");

}  // namespace of_shares

inline namespace of_sizes {

// Sizes of terms beside those of machines that have them (TermEntry::usual).
inline constexpr Rule kSurprise =
    make::assumed(3, "size by the usual one from which on it costs likelihood (Cauchy's tails)",
                  "usual sizes are known to a factor of 3");
inline constexpr Rule kTooLarge =
    make::counted(6, 1, 192, "size by the usual one: not trusted",
                  "bench_identify_rules 8 60001 20 parts and oddities: machines with a term of the list");
inline constexpr Rule kWindow = make::meaning(0.2, "Bayes factor below which a hidden term is not in the intervals",
                                              "Occam's window, Madigan and Raftery 1994; docs/validation.md");
inline constexpr Rule kSpeaks =
    make::deviations(2, 4.55e-2, "value of a rare term that is in the intervals", "1 of 20 rotors without it");
inline constexpr Rule kTells = make::assumed(
    0.5, "deviation of a rare term by its usual size: the record cannot tell it",
    "half of it; of 200 plain rotors 200 have cross-coupled damping open at 20 dB, 8 at 40 (bench_identify_rules)");
/// What is known of a term before the records: assumed, nobody has counted machines. docs/validation.md says what the
/// intervals hold with it.
inline constexpr double kCommonTerm = 0.4, kRareTerm = 0.1;  ///< share of machines that have it
inline constexpr double kEitherSign = 0.5, kDriving = 0.8;   ///< share of these where it is positive
inline constexpr double kAsLikelyAsNot = 0.5;                ///< least weight of a term that is not excluded

}  // namespace of_sizes

inline namespace usual {

/// Usual sizes.
inline constexpr Rule kOfDamping =
    make::assumed(0.3, "force of friction, rotating or cross-coupled damping or stiffness, by that of the damping",
                  "seals and joints of machines that run: at 1 the whirl would grow");
inline constexpr Rule kDampingChange =
    make::assumed(0.5, "change of the damping over a run or up to the top speed", "oil that warms by 15 K or so");
inline constexpr Rule kWarming = make::assumed(0.01, "change of the stiffness over a run",
                                               "a shaft of steel that warms by 30 K, at 0.03 % per kelvin");
inline constexpr Rule kSpringWithSpeed =
    make::assumed(0.02, "change of the stiffness up to the top speed", "twice a warming: bearings stiffen with speed");
inline constexpr Rule kQuinticAtPeak = make::assumed(0.01, "fifth-order force by the linear one at the peak",
                                                     "where the cubic one is small, as after a linearised bearing");
inline constexpr Rule kGyroscopic = make::assumed(0.05, "gyroscopic force by the inertia at the same speed",
                                                  "a disc slightly off the middle of its shaft");
inline constexpr Rule kGainDrift = make::assumed(0.02, "change of the gain of the probes over a run",
                                                 "20 to 40 K of warming at 0.05 to 0.1 % per kelvin");
inline constexpr Rule kProbe = make::assumed(0.03, "difference of gains or angle of the probes, rad",
                                             "calibrated within 5 %, mounted within some degrees");
inline constexpr Rule kProbeCurve =
    make::assumed(0.01, "bend of the probes' curve at the peak", "data sheets: about 1 % of the range");

}  // namespace usual

inline namespace of_records {

// What a record must hold.
inline constexpr Rule kSameSignal =
    make::meaning(0.99, "correlation of x and y: the same signal twice",
                  "the angle between the readings is then below 8 degrees: no orbit of a rotor in all of a run");
inline constexpr Rule kSpeedRange =
    make::assumed(0.2, "range of speeds by the highest: a run-up or run-down",
                  "a resonance of 5 % damping is 0.1 wide between its half-power points");
inline constexpr Rule kSlowRoll = make::meaning(0.3, "speed of a slow roll by the critical speed",
                                                "the motion of the unbalance is a tenth of e there");
inline constexpr Rule kNearStandstill =
    make::meaning(0.25, "lowest speed by the critical one: runout is seen apart from e",
                  "the motion of the unbalance is a fifteenth of e there");

}  // namespace of_records

inline namespace of_timing {

// Channels out of step, inputs out of step.
inline constexpr Rule kIsRate =
    make::assumed(0.05, "mean square of a rate that another channel leaves: it is that rate", "22 % in rms");
inline constexpr Rule kLateBetter =
    make::assumed(0.95, "the same with a shift in time, by that without", "kOdds20 decides by the whole model");
inline constexpr Rule kLateLeast =
    make::assumed(0.03, "samples: a shift worth a try", "a hundredth of a radian at 20 samples a turn");
inline constexpr Rule kTimingLeast =
    make::meaning(0.15, "samples that an input acts late", "less is within what a band-limited reading gets wrong");
inline constexpr Rule kTimingGain = make::meaning(0.975, "rms of free runs with another timing, by that without",
                                                  "the variance falls by 5 %: half of what the noise is known to");

}  // namespace of_timing

/// All of them.
inline constexpr std::array kAll{
    &kModelError,     &kNoTrust,       &kAnotherModel,  &kAngleUnknown,   &kMayBeColoured,
    &kHeldOutScatter, &kHeldOutMore,   &kLagLeft,       &kMostlyNoise,    &kTerm,
    &kOfSearch,       &kToldApart,     &kHint,          &kOdds20,         &kOdds150,
    &kColoured,       &kHiddenTerm,    &kImpossible,    &kVectorSeen,     &kRestDiffers,
    &kRecordsDiffer,  &kAxesToldApart, &kBand,          &kPartsDiffer,    &kNotWhite,
    &kWhiteLeft,      &kNoiseKnown,    &kColourLeast,   &kColourAlike,    &kUnexplained,
    &kLost,           &kHeldOutSeen,   &kSlight,        &kRegressionPoor, &kSpringOpen,
    &kUnbalanceOpen,  &kPartsMatter,   &kRestMatters,   &kRecordsMatter,  &kExplainsLeast,
    &kHalf,           &kRunShare,      &kRunOpen,       &kDriveAngle,     &kHiddenGain,
    &kHiddenTermGain, &kSurprise,      &kTooLarge,      &kWindow,         &kSpeaks,
    &kTells,          &kOfDamping,     &kDampingChange, &kWarming,        &kSpringWithSpeed,
    &kQuinticAtPeak,  &kGyroscopic,    &kGainDrift,     &kProbe,          &kProbeCurve,
    &kSameSignal,     &kSpeedRange,    &kSlowRoll,      &kNearStandstill, &kIsRate,
    &kLateBetter,     &kLateLeast,     &kTimingLeast,   &kTimingGain};

}  // namespace whirl::identification::rules
