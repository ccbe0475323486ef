#pragma once
#include <complex>
#include <optional>
#include <string>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/identify/evidence.hpp"
#include "whirl/identify/rotor_record.hpp"

namespace whirl::identification {

/// Which unbalance the validated run is given.
enum class UnbalanceSource {
  identified,  ///< as identified: the same rotor state
  added,       ///< identified plus the known eccentricity `ValidateOptions::added`
  refitted,    ///< fitted to the validated run (2 numbers): shows the other parameters only
};
std::string_view to_string(UnbalanceSource source);

struct ValidateOptions {
  RotorRecordOptions record;
  UnbalanceSource unbalance = UnbalanceSource::identified;
  std::complex<double> added;      ///< eccentricity of a known added mass, m, same angle zero; UnbalanceSource::added
  std::optional<Recording> clean;  ///< noise-free x, y of the same run, where known (simulated data)
  double fold_change = 0.01;       ///< relative change of k2 by which fold sensitivity is probed
  double fold_limit = 2e-5;        ///< m rms; a run that moves by more is fold-sensitive
};

/// Free-run prediction of one record that was not used to identify.
struct Validation {
  /// Of the record's x and y. Errors, bands, noise and peaks have its SI unit.
  Quantity quantity = Quantity::displacement;
  /// Against measured, rms (contains the sensor noise); NaN, with band and noise, of an axis that is not measured, and
  /// where the run was not evaluated.
  double rmse_x = NAN, rmse_y = NAN;
  double clean_rmse_x = NAN, clean_rmse_y = NAN;  ///< against `clean`, rms; NaN when not given
  double nrmse = NAN;  ///< rms of measured - simulated over rms of measured - mean, both axes
  /// What the rms error of an axis may be when the model is right: 95 % band from the noise, the intervals of its
  /// parameters and the error that it left on its own records, rms; NaN where the model states none.
  double band_x = NAN, band_y = NAN;
  double noise_x = 0, noise_y = 0;               ///< of the record, rms: the floor of rmse_x and rmse_y
  double peak_measured = 0, peak_simulated = 0;  ///< largest radius about the offset (measured includes noise)
  bool fold_sensitive = false;                   ///< a change of k2 within its uncertainty may make the run jump or not
  double fold_shift = 0;                         ///< motion by k2 (1 + fold_change), m rms of the radius
  bool after_change = false;  ///< the model changes at an instant, and this run is that of the machine since then
  UnbalanceSource unbalance = UnbalanceSource::identified;
  std::complex<double> eps;  ///< unbalance used, m
  Recording simulated;       ///< channels x, y: as the sensors would read them, without noise
  /// Unusable when the model or the record is, or the simulation diverges; warning when fold-sensitive (such a run may
  /// not be averaged with others).
  /// residual = sqrt((rmse_x^2 + rmse_y^2) / 2).
  Summary summary;
};

/// Simulates the identified rotor along the angle of `recording` and compares. Fitted to the run: the initial state (4
/// numbers), the constant of each channel, which is that of its probe and not the rotor's, and what the options allow,
/// nothing else. A constant that differs from the model's is a note, parameter_differs.
/// Runout found with the model is added to the simulated readings. Where the model was found from another quantity, the
/// errors of those sensors are left out.
/// Throws Error as rotor_record does.
Validation validate(const IdentifiedModel& model, const Recording& recording, const ValidateOptions& options = {});

/// Free run of any identified model against a record that it was not fitted to.
///
/// A model with `rotor` goes to `validate`. A library model in rotor states (method "paper") runs on its equations
/// along the measured angle, from the initial state that least squares of {1, cos beta, sin beta} on the first 0.1 s
/// gives; its unbalance is always the identified one. A run that leaves 1000 times the record's amplitude has diverged:
/// status unusable, rmse infinite. Throws Error for a model with no lateral equations.
Validation validate_model(const IdentifiedModel& model, const Recording& recording,
                          const ValidateOptions& options = {});

/// One record of `validate`. `rotor` for models of a lateral rotor, else `general`.
struct ValidationRun {
  std::string source;
  std::optional<Validation> rotor;
  HeldOut general;  ///< every measured state, over the whole record and restarted every characteristic period
  /// By state of general.near: rms error up to which the model stands for the record, SI: twice what the record's noise
  /// and the model's own residual (chi-square) account for, or 3 % of the motion.
  std::vector<double> band;
  /// By state of general.scores: the same of one free run over the whole record, by the noise and by how far the
  /// intervals of the model and the noise in the start move it. NaN where that is a quarter of the motion or more
  /// (chaos): such a run tells nothing. Empty where `band` is left.
  std::vector<double> band_whole;
  /// Verdict on this record: unusable also where the error of a run that is not fold-sensitive leaves the model's band,
  /// or is as large as the motion. What is wrong with the record is a warning then. A warning, too, where the model is
  /// within its band only because it did not explain its own records, and where one free run over the whole record
  /// leaves `band_whole`; from half of the motion on that is unusable.
  Summary summary;
};
struct ValidationReport {
  std::vector<ValidationRun> runs;
  Summary summary;  ///< unusable when one run is
};
/// Free runs of a model of any kind against records that were not used for its fit: the call behind `whirl validate`.
/// `clean`: the noise-free record of each, or empty; rotors only. Throws Error as `validate_model`, and for a model
/// that cannot be run on a record.
ValidationReport validate(const IdentifiedModel& model, const std::vector<Recording>& records,
                          const ValidateOptions& options = {}, const std::vector<Recording>& clean = {});

}  // namespace whirl::identification
