#pragma once
#include "whirl/balancing/solve.hpp"
#include "whirl/io/units.hpp"

namespace whirl::balancing {

/// The options, and where one is not stated what the job's file states.
JobOptions with_plan(JobOptions options, const JobFile& file);

/// The unit in which the readings are written; where the file does not say it, um, mm/s or m/s^2.
const io::UnitSuffix& reading_unit(const JobFile& file);
/// Degrees in [0, 360) as the job writes angles.
double written_angle(double angle, double sign);
/// Holes and pieces of every plane; empty when any place and mass will do.
std::vector<diagnosis::Places> places_of(const JobOptions& options, const VectorConvention& convention,
                                         std::size_t planes);
diagnosis::InfluenceOptions influence_options(const JobOptions& options);
const char* criterion_name(const JobOptions& options);

/// A sheet with its title, the convention of its vectors and the criterion.
BalancingSheet empty_sheet(const std::string& title, const VectorConvention& convention, const JobOptions& options);
/// The estimate times a positive factor.
Estimate scaled(const Estimate& estimate, double factor);
/// An angle as the job counts it.
Estimate counted(const Estimate& angle, double sign);
/// Key of an influence coefficient of this quantity: "m_per_kg".
std::string_view per_kg(Quantity quantity);
/// Begin of whirl.balancing: the convention of the vectors and the criterion.
io::Json balancing_document(const BalancingSheet& sheet);

/// Vectors of run-ups are linear in the masses only where all runs have one rate: a warning where they have not. None
/// where the file does not state the rates.
void warn_of_differing_rates(const JobFile& file, Summary& summary);

/// The same with what an earlier job or a model knew of the influence (options.prior); trials may be missing.
SolvedJob solve_with_prior(const std::string& title, const JobFile& file, const JobOptions& options);

}  // namespace whirl::balancing
