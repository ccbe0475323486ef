#include "whirl/shaft/control/export_c.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr std::string_view kHeader = R"(#ifndef @NAME@_h
#define @NAME@_h
/* Controller of a flexible rotor, @RATE@ steps a second. Readings in m, with their runout: @PROBES@.
   Forces in N: @ACTUATORS@; they act from the next step on. angle of the shaft in rad, speed in rad/s. */
#define @NAME@_STATES @N@
#define @NAME@_READINGS @P@
#define @NAME@_FORCES @M@
typedef struct {
  double state[@N@], force[@M@], adapted[@M@][2];
} @NAME@_state;
void @NAME@_start(@NAME@_state* s);
void @NAME@_step(@NAME@_state* s, const double readings[@P@], double angle, double speed, double forces[@M@]);
#endif
)";

constexpr std::string_view kSource = R"(
/* Entry of a table below x and part of the way to the next. */
static int place(const double* at, int count, double x, double* part) {
  int k = 0;
  *part = 0;
  if (count < 2 || x <= at[0]) return 0;
  if (x >= at[count - 1]) {
    *part = 1;
    return count - 2;
  }
  while (at[k + 1] <= x) ++k;
  *part = (x - at[k]) / (at[k + 1] - at[k]);
  return k;
}

#define AT(table, k, part, i) ((1 - (part)) * (table)[k][i] + ((part) > 0 ? (part) * (table)[(k) + 1][i] : 0))

void @NAME@_start(@NAME@_state* s) {
  int i;
  for (i = 0; i < N; ++i) s->state[i] = 0;
  for (i = 0; i < M; ++i) s->force[i] = s->adapted[i][0] = s->adapted[i][1] = 0;
}

void @NAME@_step(@NAME@_state* s, const double seen[P], double angle, double speed, double forces[M]) {
  double next[N], part, wanted, rate;
  const double square = speed * speed + SLOW, c = cos(angle), d = sin(angle);
  double turning[M], readings[P];
  int i, j, k = place(gain_speed, GAINS, speed, &part);
  for (i = 0; i < P; ++i) readings[i] = seen[i] - (runout_re[i] * c - runout_im[i] * d);
  for (i = 0; i < N; ++i) {
    next[i] = 0;
    for (j = 0; j < N; ++j) next[i] += AT(advance, k, part, i * N + j) * s->state[j];
    for (j = 0; j < P; ++j) next[i] += AT(reading, k, part, i * P + j) * readings[j];
    for (j = 0; j < M; ++j) next[i] += AT(force, k, part, i * M + j) * s->force[j];
  }
  for (i = 0; i < M; ++i) {
    turning[i] = 0;
    for (j = 0; j < N; ++j) turning[i] -= AT(feedback, k, part, i * N + j) * next[j];
  }
  for (i = 0; i < N; ++i) s->state[i] = next[i];
  k = place(turning_speed, TURNING, speed, &part);
  for (i = 0; i < M; ++i) {
    double re = 0, im = 0, size, most = AT(turning_most, k, part, i);
    const double re0 = AT(start_re, k, part, i), im0 = AT(start_im, k, part, i);
    for (j = 0; j < P; ++j) {
      re += AT(correction_re, k, part, i * P + j) * readings[j];
      im += AT(correction_im, k, part, i * P + j) * readings[j];
    }
    for (j = 0; j < M; ++j) {
      re += AT(relief_re, k, part, i * M + j) * s->force[j];
      im += AT(relief_im, k, part, i * M + j) * s->force[j];
    }
    s->adapted[i][0] -= LEARN / square * (c * re + d * im);
    s->adapted[i][1] -= LEARN / square * (c * im - d * re);
    re = re0 + square * s->adapted[i][0];
    im = im0 + square * s->adapted[i][1];
    size = sqrt(re * re + im * im);
    if (size > most) {
      re *= most / size;
      im *= most / size;
    }
    s->adapted[i][0] = (re - re0) / square;
    s->adapted[i][1] = (im - im0) / square;
    turning[i] += re * c - im * d;
  }
  for (i = 0; i < M; ++i) {
    wanted = turning[i];
    rate = slew[i];
    if (wanted > s->force[i] + rate) wanted = s->force[i] + rate;
    if (wanted < s->force[i] - rate) wanted = s->force[i] - rate;
    if (wanted > limit[i]) wanted = limit[i];
    if (wanted < -limit[i]) wanted = -limit[i];
    forces[i] = wanted;
  }
  for (i = 0; i < M; ++i) s->force[i] = forces[i];
}
)";

std::string filled(std::string_view text, const std::vector<std::pair<std::string, std::string>>& values) {
  std::string out(text);
  for (const auto& [key, value] : values)
    for (std::size_t at = 0; (at = out.find("@" + key + "@", at)) != std::string::npos; at += value.size())
      out.replace(at, key.size() + 2, value);
  return out;
}

/// One row of numbers an entry, matrices by rows.
template <class Entry, class Part>
std::string table(const char* name, const std::vector<Entry>& entries, Part part) {
  std::string out;
  Index count = 0;
  for (const Entry& e : entries) {
    const MatrixXd m = part(e);
    count = m.size();
    std::string row;
    for (Index i = 0; i < m.rows(); ++i)
      for (Index j = 0; j < m.cols(); ++j) row += fmt::format("{}{:.17g}", row.empty() ? "" : ", ", m(i, j));
    out += fmt::format("{}\n  {{{}}}", out.empty() ? "" : ",", row);
  }
  return fmt::format("static const double {}[{}][{}] = {{{}}};\n", name, entries.size(), count, out);
}
std::string row(const char* name, const std::vector<double>& values) {
  return fmt::format("static const double {}[{}] = {{{:.17g}}};\n", name, values.size(), fmt::join(values, ", "));
}

std::string tables(const RotorController& c) {
  std::vector<double> gain_speed, turning_speed, limit, slew, runout_re, runout_im;
  for (const Probe& p : c.probes) {
    runout_re.push_back(p.runout * std::cos(p.runout_angle));
    runout_im.push_back(p.runout * std::sin(p.runout_angle));
  }
  for (const ControlGains& g : c.gains) gain_speed.push_back(g.speed);
  for (const SynchronousGains& g : c.synchronous) turning_speed.push_back(g.speed);
  for (const Actuator& a : c.actuators) {
    limit.push_back(a.force_limit);
    slew.push_back(a.slew > 0 ? a.slew * c.sample_time : 2 * a.force_limit);
  }
  using G = ControlGains;
  using S = SynchronousGains;
  return row("runout_re", runout_re) + row("runout_im", runout_im) + row("gain_speed", gain_speed) +
         table("advance", c.gains, [](const G& g) { return g.advance; }) +
         table("reading", c.gains, [](const G& g) { return g.readings; }) +
         table("force", c.gains, [](const G& g) { return g.forces; }) +
         table("feedback", c.gains, [](const G& g) { return g.feedback; }) + row("turning_speed", turning_speed) +
         table("correction_re", c.synchronous, [](const S& g) { return MatrixXd(g.correction.real()); }) +
         table("correction_im", c.synchronous, [](const S& g) { return MatrixXd(g.correction.imag()); }) +
         table("relief_re", c.synchronous, [](const S& g) { return MatrixXd(g.relief.real()); }) +
         table("relief_im", c.synchronous, [](const S& g) { return MatrixXd(g.relief.imag()); }) +
         table("start_re", c.synchronous, [](const S& g) { return MatrixXd(g.start.real()); }) +
         table("start_im", c.synchronous, [](const S& g) { return MatrixXd(g.start.imag()); }) +
         table("turning_most", c.synchronous, [](const S& g) { return MatrixXd(g.most); }) + row("limit", limit) +
         row("slew", slew);
}

template <class Part>
std::string names(const std::vector<Part>& parts) {
  std::string out;
  for (const Part& p : parts) {
    out += out.empty() ? "" : ", ";
    for (const char ch : p.name) out += std::isalnum(static_cast<unsigned char>(ch)) != 0 ? ch : ' ';
  }
  return out;
}

}  // namespace

ControllerCode controller_code(const RotorController& c, std::string_view name) {
  check(c);
  bool fits = !name.empty() && std::isdigit(static_cast<unsigned char>(name.front())) == 0;
  for (const char ch : name) fits = fits && (std::isalnum(static_cast<unsigned char>(ch)) != 0 || ch == '_');
  if (!fits) throw Error::in_field("name of the C code", name, "letters, digits and underscores, a letter first");
  const auto number = [](auto value) { return fmt::format("{}", value); };
  const std::vector<std::pair<std::string, std::string>> values{
      {"NAME", std::string(name)},       {"N", number(c.states())},           {"P", number(c.probes.size())},
      {"M", number(c.actuators.size())}, {"RATE", number(1 / c.sample_time)}, {"PROBES", names(c.probes)},
      {"ACTUATORS", names(c.actuators)}};
  ControllerCode code;
  code.header = filled(kHeader, values);
  code.source = filled("#include \"@NAME@.h\"\n\n#include <math.h>\n\nenum { N = @N@, P = @P@, M = @M@, ", values) +
                fmt::format("GAINS = {}, TURNING = {} }};\n#define LEARN {:.17g}\n#define SLOW {:.17g}\n",
                            c.gains.size(), c.synchronous.size(), 2 * c.adaptation * c.sample_time, turning_floor(c)) +
                tables(c) + filled(kSource, values);
  return code;
}

}  // namespace whirl::shaft
