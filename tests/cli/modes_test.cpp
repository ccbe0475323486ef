#include <gtest/gtest.h>

#include <cmath>

#include "program.hpp"
#include "whirl/core/modal_model.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::testing {
namespace {

TEST(ModesE2e, HammerTestOfTheRigGivesItsFiveModesWithAndWithoutWindow) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rig hammer --out blow_").exit_code, 0);
  for (const char* window : {"100", "1"}) {
    const Outcome frf = folder.whirl(std::string("frf blow_*.csv --out frf.json --figure frf.svg --window-end-percent ") + window);
    ASSERT_EQ(frf.exit_code, 0) << frf.err;
    const Outcome modes = folder.whirl("modes frf.json --out modes.json --figure stabilisation.svg --figure fit_frf.svg");
    ASSERT_EQ(modes.exit_code, 0) << modes.err;
    const ModalModel model = load<ModalModel>(folder / "modes.json");
    // sqrt(K (1 -+ split) / m) / 2 pi of the doublet, then the frequencies in `whirl rig parameters`.
    for (const double f : {11.86, 12.10, 46.0, 128.0, 310.0}) {
      bool found = false;
      for (const Mode& mode : model.modes) found = found || std::abs(mode.frequency.value / f - 1) < 0.0015;
      EXPECT_TRUE(found) << f << " Hz, window " << window << "\n" << modes.out;
    }
    for (const char* figure : {"frf.svg", "stabilisation.svg", "fit_frf.svg"}) EXPECT_NE(slurp(folder / figure).find("<svg"), std::string::npos);
  }
}

}  // namespace
}  // namespace whirl::testing
