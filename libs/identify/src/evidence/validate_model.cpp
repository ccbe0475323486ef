#include "whirl/identify/validate_model.hpp"

namespace whirl::identification {

io::Json to_json(const Validation& v, const std::string& file) {
  io::Json run = io::Json::object();
  run.set("file", file);
  run.set("rmse_x", v.rmse_x).set("rmse_y", v.rmse_y).set("nrmse", v.nrmse);
  run.set("clean_rmse_x", v.clean_rmse_x).set("clean_rmse_y", v.clean_rmse_y);
  run.set("noise_x", v.noise_x).set("noise_y", v.noise_y);
  run.set("peak_measured", v.peak_measured).set("peak_simulated", v.peak_simulated);
  run.set("fold_sensitive", v.fold_sensitive);
  run.set("unbalance", std::string(to_string(v.unbalance)));
  run.set("summary", io::to_json(v.summary));
  return run;
}

}  // namespace whirl::identification
