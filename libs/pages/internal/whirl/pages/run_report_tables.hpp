#pragma once
#include <optional>
#include <string>
#include <vector>

#include "whirl/diagnosis/standards.hpp"
#include "whirl/identify/validate.hpp"
#include "whirl/pages/run_report.hpp"
#include "whirl/report/table.hpp"
#include "whirl/tuning/closed_loop.hpp"

namespace whirl::pages {

/// The largest 1X amplitude of one channel of one run.
struct CriticalRow {
  std::string run, channel;
  double critical = 0, amplitude = 0;  ///< rad/s; SI unit of the curve's quantity, peak
  std::optional<diagnosis::Amplification> reading;
  signal::SynchronousCurve curve;
};

report::Table run_table(const std::vector<NamedFile<Recording>>& records);
report::Table critical_table(const std::vector<CriticalRow>& rows, double service_speed);
report::Table zone_table(const std::vector<CriticalRow>& rows, double service_speed);
inline constexpr double kGradeOfCentrifuges = 6.3;  // mm/s, of separators and decanters
/// Balance quality of a model (ISO 21940-11) at the service speed, or the highest of the runs.
struct BalanceQuality {
  std::string model;
  Estimate eccentricity;      ///< m
  double speed = 0;           ///< rad/s
  double grade = 0;           ///< m/s
  double held = 0;            ///< the smallest grade of the series that holds it, mm/s; infinity above all
  std::string words() const;  ///< "G 100"
  double allowed() const;     ///< um, the eccentricity that G 6.3 allows at this speed
};
std::vector<BalanceQuality> balance_quality(const std::vector<NamedFile<IdentifiedModel>>& models,
                                            const std::vector<CriticalRow>& rows, double service_speed);
report::Table grade_table(const std::vector<BalanceQuality>& models);
report::Table mode_list(const std::string& name, const ModalModel& modes);
report::Table validation_columns();
void add_validation(report::Table& table, const std::string& model, const std::string& record, bool trained,
                    const identification::Validation& v);
void add_validation_file(report::Table& table, const std::string& name, const io::Json& json);
report::Table run_file_table(const std::string& name, const io::Json& json, bool with_paper);
std::vector<std::pair<std::string, std::string>> controller_values(const ControllerDesign& design);
std::vector<std::pair<std::string, std::string>> effort_values(const tuning::ClosedLoopMetrics& m);

/// Peaks, suppression and effort read from the log of a closed loop; the first 0.5 s are left out of the peaks.
tuning::ClosedLoopMetrics metrics_of_log(const Recording& log, double natural_frequency, double force_limit);
/// Times at which the segments of the log begin and end.
std::vector<report::Segment> segment_times(const Recording& log, double natural_frequency);

}  // namespace whirl::pages
