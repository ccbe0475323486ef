#include <fmt/format.h>

#include <array>

#include "whirl/report/figure.hpp"

namespace whirl::report {
namespace {

struct Theme {
  std::string_view text, axis, grid, plot, page;
  std::array<std::string_view, 8> colors;
};

// Okabe and Ito, "Color universal design" (2008), without its yellow, which is too light for lines; on a dark page the
// same hues, lighter.
constexpr Theme kLight = {
    "#1f2328", "#57606a", "#e3e6ea",
    "#ffffff", "#ffffff", {"#0072b2", "#d55e00", "#009e73", "#b2609a", "#d98f00", "#56b4e9", "#1f2328", "#7a828b"}};
constexpr Theme kDark = {
    "#e6e9ec", "#9aa4ae", "#30363d",
    "#14181d", "#0d1117", {"#5db7ee", "#ff8c4b", "#3fcf9f", "#e59bcb", "#f2b84b", "#9bd3f7", "#e6e9ec", "#98a1ab"}};

std::string rules(const Theme& theme, bool all) {
  std::string out;
  if (all) {
    out +=
        ".wf text{font:11px \"Helvetica Neue\",Helvetica,Arial,\"Liberation Sans\",sans-serif;"
        "font-variant-numeric:tabular-nums}"
        ".wf .title{font-weight:600;font-size:12px}.wf .page{stroke:none}"
        ".wf .frame,.wf .ring{fill:none}.wf .halo{paint-order:stroke;stroke-width:3px;stroke-linejoin:round}"
        ".wf path{fill:none;stroke-linejoin:round}";
  }
  out += fmt::format(
      ".wf text{{fill:{}}}.wf .ax,.wf .frame{{stroke:{};stroke-width:1}}"
      ".wf .grid,.wf .ring{{stroke:{};stroke-width:1}}.wf .plot{{fill:{}}}.wf .page{{fill:{}}}"
      ".wf .halo{{stroke:{}}}",
      theme.text, theme.axis, theme.grid, theme.plot, theme.page, theme.plot);
  for (std::size_t i = 0; i < theme.colors.size(); ++i) {
    out += fmt::format(".wf .s{0}{{stroke:{1}}}.wf .f{0}{{fill:{1}}}", i, theme.colors[i]);
  }
  return out;
}

}  // namespace

std::string figure_style(bool dark_scheme) {
  std::string out = rules(kLight, true);
  // Print always uses the light rules.
  if (dark_scheme) out += "@media screen and (prefers-color-scheme:dark){" + rules(kDark, false) + "}";
  return out;
}

}  // namespace whirl::report
