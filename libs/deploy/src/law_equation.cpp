#include <map>

#include "whirl/control/catalogue.hpp"
#include "whirl/deploy/code.hpp"

namespace whirl::deploy {
namespace {

const char* const kPhi = R"(\varphi(x) = L\,\mathrm{sig}(x/L)^{r})";
const char* const kLinear = R"(s = v + C x)";

std::string join(std::initializer_list<std::string> lines) {
  std::string out;
  for (const std::string& line : lines) out += (out.empty() ? "" : ",\\quad ") + line;
  return out;
}

std::map<std::string, LawEquation> make_equations() {
  const std::string terminal_text =
      "     s = v + C phi(x),  a = -[f + C phi'(x) v + rho tanh(s/eps)],  phi(x) = L sig(x/L)^r\n"
      "   (Piramoon, Ayoubi, Bashash 2024, eqs. 27 and 43)";
  const std::string terminal =
      join({R"(s = v + C \varphi(x))", R"(a = -\left[f + C \varphi'(x) v + \rho \tanh(s/\varepsilon)\right])", kPhi});
  const std::string pd_text = "     a = -kp x - kd v - d";
  const std::string pd = R"(a = -k_p x - k_d v - d)";
  const auto synchronous = [&](const std::string& text, const std::string& latex) {
    return LawEquation{pd_text + ", and the canceller of the synchronous motion below: " + text,
                       join({R"(a = -k_p z - k_d \dot z - d + q F)", latex})};
  };
  const std::string g = R"(G = \frac{\omega^2}{k_1 - \omega^2 + i \omega c + (k_p + i \omega k_d) e^{-i\omega\tau}})";
  return {
      {"tsmc", {terminal_text, terminal}},
      {"tsmc_paper", {terminal_text, terminal}},
      {"lsmc",
       {"     s = v + C x,  a = -[f + C v + rho tanh(s/eps)]",
        join({kLinear, R"(a = -\left[f + C v + \rho \tanh(s/\varepsilon)\right])"})}},
      {"ntsmc",
       {"     s = C x + C L sig(v/(C L))^g,  a = -[f + (C/g) C L sig(v/(C L))^(2-g) + rho tanh(s/eps)],  g = 1/r\n"
        "   (Feng, Yu, Man 2002)",
        join(
            {R"(s = C x + C L\,\mathrm{sig}\left(\frac{v}{CL}\right)^{g})",
             R"(a = -\left[f + \frac{C}{g} C L\,\mathrm{sig}\left(\frac{v}{CL}\right)^{2-g} + \rho \tanh(s/\varepsilon)\right])",
             R"(g = 1/r)"})}},
      {"ftsmc",
       {"     s = v + alpha x + C phi(x),  a = -[f + (alpha + C phi'(x)) v + rho tanh(s/eps)]\n"
        "   (Yu, Man 2002)",
        join({R"(s = v + \alpha x + C \varphi(x))",
              R"(a = -\left[f + (\alpha + C \varphi'(x)) v + \rho \tanh(s/\varepsilon)\right])", kPhi})}},
      {"nftsmc",
       {"     s = C [x + kappa L sig(x/L)^a1] + C L sig(v/(C L))^g,  g = 1/r\n"
        "     a = -[f + (C/g) C L sig(v/(C L))^(2-g) (1 + kappa a1 |x/L|^(a1-1)) + rho tanh(s/eps)]\n"
        "   (Yang, Yang 2011)",
        join(
            {R"(s = C \left[x + \kappa L\,\mathrm{sig}(x/L)^{a_1}\right] + C L\,\mathrm{sig}\left(\frac{v}{CL}\right)^{g})",
             R"(a = -\left[f + \frac{C}{g} C L\,\mathrm{sig}\left(\frac{v}{CL}\right)^{2-g} \left(1 + \kappa a_1 |x/L|^{a_1-1}\right) + \rho \tanh(s/\varepsilon)\right])"})}},
      {"smc_implicit",
       {"     s = v + C x,  a = -f - C v - clamp(s/tau, -rho, rho)   (Acary, Brogliato, Orlov 2012)",
        join({kLinear, R"(a = -f - C v - \mathrm{clamp}(s/\tau, -\rho, \rho))"})}},
      {"tsmc_implicit",
       {"     z + h C phi(z) = x,  s = v - (z - x)/h,  a = -f + clamp(-s/tau, -rho, rho)",
        join({R"(z + h C \varphi(z) = x)", R"(s = v - (z - x)/h)", R"(a = -f - \mathrm{clamp}(s/\tau, -\rho, \rho))",
              kPhi})}},
      {"sta",
       {"     s = v + C x,  a = -f - C v - k1 sig(s)^(1/2) + w,  w' = -k2 sgn(s),  k1 = 1.5 sqrt(L), k2 = 1.1 L\n"
        "   (Levant 1998; Moreno, Osorio 2012)",
        join({kLinear, R"(a = -f - C v - k_1\,\mathrm{sig}(s)^{1/2} + w)", R"(\dot w = -k_2\,\mathrm{sgn}(s))"})}},
      {"sta_implicit",
       {"     s = v + C x,  a = -f - C v - k1 sig(s)^(1/2) + w,  w' = -k2 sgn(s): backward Euler solved exactly\n"
        "   (Brogliato, Polyakov, Efimov 2020)",
        join({kLinear, R"(a = -f - C v - k_1\,\mathrm{sig}(s^+)^{1/2} + w^+)",
              R"(w^+ = w - h k_2\,\mathrm{sgn}(s^+))"})}},
      {"asmc",
       {"     s = v + C x,  a = -f - C v - K tanh(s/eps),  K' = rate |s| sgn(|s| - mu), gain_min <= K <= gain_max\n"
        "   (Plestan, Shtessel, Bregeault, Poznyak 2010)",
        join(
            {kLinear, R"(a = -f - C v - K \tanh(s/\varepsilon))", R"(\dot K = \bar K |s|\,\mathrm{sgn}(|s| - \mu))"})}},
      {"bsmc",
       {"     s = v + C x,  a = -f - C v - K sgn(s),  K = K0 |s|/(e - |s|), at most gain_max\n"
        "   (Obeid, Fridman, Laghrouche, Harmouche 2018)",
        join({kLinear, R"(a = -f - C v - K\,\mathrm{sgn}(s))",
              R"(K = \min\left(\frac{K_0 |s|}{e - |s|}, K_{\max}\right))"})}},
      {"pd", {pd_text, pd}},
      {"lqr", {pd_text + ", gains of the discrete Riccati equation", pd}},
      {"mpc",
       {"     a = w_0 - d,  w minimises sum (w_k + kp x_k + kd v_k)^2 with |w_k - d_k| <= limit over the horizon",
        join({R"(a = w_0 - d)", R"(\min_{w} \sum_{k<N} (w_k + k_p x_k + k_d v_k)^2)", R"(|w_k - d_k| \le a_{\max})"})}},
      {"pid",
       {"     a = -kp x - kd v - i - d,  i' = ki x,  |i| <= integral_limit",
        join({R"(a = -k_p x - k_d v - i - d)", R"(\dot i = k_i x)", R"(|i| \le i_{\max})"})}},
      {"pd_influence",
       synchronous("influence coefficients, once per turn", join({R"(q \leftarrow q - \mu \bar X / G)", g}))},
      {"pd_fxlms", synchronous("filtered-x LMS", join({R"(q \leftarrow q - h \mu G^{*} z e^{-i\beta})", g}))},
      {"pd_notch",
       synchronous("generalised notch", join({R"(q \leftarrow q - h \mu e^{-i \arg G} z e^{-i\beta})", g}))},
  };
}

}  // namespace

const LawEquation& law_equation(const std::string& law) {
  static const std::map<std::string, LawEquation> all = make_equations();
  control::law_info(law);  // names the known laws in its error
  return all.at(law);
}

}  // namespace whirl::deploy
