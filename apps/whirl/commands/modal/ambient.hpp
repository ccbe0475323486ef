#pragma once
#include <string>
#include <vector>

#include "command.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/modal/fdd.hpp"

namespace whirl::app {

/// `whirl oma`: modes of records without the force.
void add_oma(CommandLine& app, Session& session);

/// Enhanced frequency domain decomposition of one record: table, document, figures.
void show_fdd(const Recording& record, const modal::FddOptions& options, const std::string& out,
              const std::vector<std::string>& figures, Session& session);

/// Throws Error when `file` names another format than the JSON that would be written under that name.
void require_json_name(const std::string& file);

}  // namespace whirl::app
