// Identification of files that are read in parts.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "../program.hpp"
#include "duffing_record.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::testing {
namespace {

TEST(IdentifyStreamE2e, AFileReadInPartsGivesTheSameEquations) {
  const Folder folder;
  io::write_csv(folder / "long.csv", duffing(150000));
  const Outcome o = folder.whirl("identify long.csv --states x,v --inputs u --stream --out model.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto m = io::load<IdentifiedModel>(folder / "model.json");
  EXPECT_EQ(m.equations[0].terms.size(), 1u);
  EXPECT_EQ(m.equations[1].terms.size(), 4u);
  EXPECT_NEAR(coefficient(m, "v'", "x^3"), -1, 0.005);
  EXPECT_NE(o.out.find("held out          the last"), std::string::npos) << o.out;

  io::write_hdf5(folder / "long.h5", io::read_csv(folder / "long.csv"));
  const Outcome h5 = folder.whirl("identify long.h5 --states x,v --inputs u --stream --out h5.json");
  ASSERT_EQ(h5.exit_code, 0) << h5.err;
  EXPECT_NEAR(coefficient(io::load<IdentifiedModel>(folder / "h5.json"), "v'", "x^3") / coefficient(m, "v'", "x^3"), 1,
              1e-9);
  for (const char* wrong : {"identify long.h5 --states w --stream", "identify long.h5 --method weak --stream",
                            "identify long.h5 --stream --compare"}) {
    EXPECT_EQ(folder.whirl(wrong).exit_code, 2) << wrong;
  }
}

/// Error of one free run and of restarted ones on the part held out, per state.
struct HeldOutErrors {
  std::string what;
  std::vector<double> run, near;
};
HeldOutErrors held_out_errors(const std::filesystem::path& model) {
  const io::Json file = io::load_json(model);
  const io::Json* held = file.find("evidence")->find("held_out");
  HeldOutErrors out{*held->find("what")->get<std::string>(), {}, {}};
  for (const io::Json& s : *held->find("free_run")->get<io::Json::Array>())
    out.run.push_back(*s.find("rmse")->get<double>());
  for (const io::Json& s : *held->find("free_run_horizon")->get<io::Json::Array>())
    out.near.push_back(*s.find("rmse")->get<double>());
  return out;
}

TEST(IdentifyStreamE2e, TheHeldOutErrorIsThatOfTheFileReadWhole) {
  const Folder folder;
  io::write_csv(folder / "long.csv", duffing(150000));
  const std::string identify = "identify long.csv --states x,v --inputs u --no-refine";
  for (const std::string share : {"", " --holdout 0.8"}) {
    ASSERT_EQ(folder.whirl(identify + " --out whole.json" + share).exit_code, 0);
    const Outcome o = folder.whirl(identify + " --stream --out parts.json" + share);
    ASSERT_EQ(o.exit_code, 0) << o.err;
    const HeldOutErrors whole = held_out_errors(folder / "whole.json"), parts = held_out_errors(folder / "parts.json");
    EXPECT_EQ(parts.what, whole.what);
    EXPECT_NE(o.out.find("held out          the last " + std::string(share.empty() ? "30" : "80") + " % of long.csv"),
              std::string::npos)
        << o.out;
    // Windows of the weak form end at the ends of parts: 30000 samples to fit lie in one part, 105000 in two.
    const double tolerance = share.empty() ? 0.005 : 1e-6;
    ASSERT_EQ(parts.run.size(), 2u);
    ASSERT_EQ(parts.near.size(), 2u);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_NEAR(parts.run[k] / whole.run[k], 1, tolerance) << share << k;
      EXPECT_NEAR(parts.near[k] / whole.near[k], 1, tolerance) << share << k;
    }
  }
  const Outcome none = folder.whirl(identify + " --stream --no-holdout");
  ASSERT_EQ(none.exit_code, 0) << none.err;
  EXPECT_EQ(none.out.find("held out"), std::string::npos) << none.out;
  // A record of a single part can be streamed too.
  io::write_csv(folder / "short.csv", duffing());
  EXPECT_EQ(folder.whirl("identify short.csv --states x,v --inputs u --stream").exit_code, 0);
}

}  // namespace
}  // namespace whirl::testing
