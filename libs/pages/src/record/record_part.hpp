#pragma once
#include "whirl/pages/record_views.hpp"

namespace whirl::pages {

/// The channels of a figure: those of the options, else x and y where they are, else the motions (displacement,
/// velocity, acceleration) of one quantity, that of the first; else the first channel.
std::vector<std::string> channels_of(const ViewOptions& options, const Recording& record);

/// The motions in the quantity of the unit asked for, by integration; the record where none was asked for.
Recording in_asked_quantity(Recording record, const ViewOptions& options);
/// What `in_asked_quantity` does to the channel: "velocity by integration from 10 Hz on"; empty: nothing.
std::string integration_text(const Channel& channel, const ViewOptions& options);

std::vector<report::NamedRun> named(const std::vector<ViewedRun>& runs);

/// Samples between the begin and the end of the options. Throws Error when they are fewer than 16.
Recording cut(const Recording& record, const ViewOptions& options);

/// Straight lines over missing readings of the motions, for spectra and paths.
Recording with_straight_lines(Recording record);

}  // namespace whirl::pages
