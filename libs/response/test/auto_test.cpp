// Folds against auto-07p (Doedel et al.), an independent program with orthogonal collocation. Skipped where it is not
// installed.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "whirl/response/continuation.hpp"

namespace whirl::response {
namespace {

struct Oracle {
  const char* name;
  std::vector<std::string> states;                ///< position, velocity, position, velocity, ...
  std::vector<std::array<std::string, 2>> rates;  ///< of each velocity: in whirl's terms and in Fortran
  double force, from, to;
  int folds;
};

std::vector<double> folds_of_auto(const Oracle& o) {
  std::array<char, 64> name{"/tmp/whirl_auto_XXXXXX"};
  if (mkdtemp(name.data()) == nullptr) return {};
  const std::filesystem::path folder = name.data();
  const auto n = static_cast<int>(o.states.size());
  std::ofstream f(folder / "sys.f90");
  f << "SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,DFDU,DFDP)\nIMPLICIT NONE\nINTEGER, INTENT(IN) :: NDIM, ICP(*), IJAC\n"
       "DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)\nDOUBLE PRECISION, INTENT(OUT) :: F(NDIM)\n"
       "DOUBLE PRECISION, INTENT(INOUT) :: DFDU(NDIM,NDIM), DFDP(NDIM,*)\nDOUBLE PRECISION ";
  for (const std::string& s : o.states) f << s << ",";
  f << "s,c,w,r2,forcing\nw=PAR(1)\n";
  for (int i = 0; i < n; ++i) f << o.states[static_cast<std::size_t>(i)] << "=U(" << i + 1 << ")\n";
  f << "s=U(" << n + 1 << ")\nc=U(" << n + 2 << ")\nr2=s*s+c*c\nforcing=PAR(2)*c\n";
  for (int i = 0; i < n; i += 2) {
    f << "F(" << i + 1 << ")=" << o.states[static_cast<std::size_t>(i) + 1] << "\n";
    f << "F(" << i + 2 << ")=" << o.rates[static_cast<std::size_t>(i / 2)][1] << "\n";
  }
  f << "F(" << n + 1 << ")=s+w*c-s*r2\nF(" << n + 2 << ")=c-w*s-c*r2\nEND SUBROUTINE FUNC\n";
  f << "SUBROUTINE STPNT(NDIM,U,PAR,T)\nIMPLICIT NONE\nINTEGER, INTENT(IN) :: NDIM\n"
       "DOUBLE PRECISION, INTENT(INOUT) :: U(NDIM),PAR(*)\nDOUBLE PRECISION, INTENT(IN) :: T\nDOUBLE PRECISION TPI\n"
       "TPI=8*ATAN(1.0D0)\nPAR(1)="
    << o.from << "D0\nPAR(2)=0D0\nPAR(11)=TPI/PAR(1)\nU=0D0\nU(" << n + 1 << ")=SIN(TPI*T)\nU(" << n + 2
    << ")=COS(TPI*T)\nEND SUBROUTINE STPNT\n";
  for (const char* empty : {"BCND", "ICND", "FOPT", "PVLS"})
    f << "SUBROUTINE " << empty << "\nEND SUBROUTINE " << empty << "\n";
  f.close();
  std::ofstream script(folder / "run.py");
  script << "r=run(e='sys',NDIM=" << n + 2
         << ",IPS=2,IRS=0,ILP=1,ICP=[2,11],NTST=60,NCOL=4,IAD=3,ISP=0,ISW=1,IPLT=0,NBC=0,NINT=0,NMX=400,NPR=400,MXBF=0,"
            "IID=2,ITMX=12,ITNW=8,NWTN=3,JAC=0,EPSL=1e-9,EPSU=1e-9,EPSS=1e-9,DS=0.02,DSMIN=1e-6,DSMAX=0.2,IADS=1,"
            "NPAR=36,UZSTOP={2:"
         << o.force << "},THL={},THU={})\nq=run(r('UZ1'),ICP=[1,11],NMX=3000,UZSTOP={1:" << o.to
         << "},DS=0.01,DSMAX=0.05,NPR=4000)\nfor l in q('LP'): print('FOLD %.12f'%l['PAR(1)'])\n";
  script.close();
  const std::string command = "cd " + folder.string() + " && timeout 150 auto-07p run.py > out.txt 2>&1";
  std::vector<double> folds;
  if (std::system(command.c_str()) == 0) {
    std::ifstream out(folder / "out.txt");
    std::string line;
    while (std::getline(out, line))
      if (line.starts_with("FOLD ")) folds.push_back(std::stod(line.substr(5)));
  }
  std::filesystem::remove_all(folder);
  return folds;
}

IdentifiedModel model_of(const Oracle& o) {
  IdentifiedModel m;
  m.states = o.states;
  m.inputs = {"u"};
  for (std::size_t i = 0; i < o.states.size(); i += 2) {
    m.equations.push_back({o.states[i] + "'", {{o.states[i + 1], {1, 0, 1, 1}, ""}}});
    Equation rate{o.states[i + 1] + "'", {}};
    rate.terms.push_back({o.rates[i / 2][0], {1, 0, 1, 1}, ""});
    m.equations.push_back(rate);
  }
  return m;
}

TEST(ResponseReference, FoldsAgreeWithAuto) {
  if (std::system("command -v auto-07p > /dev/null 2>&1 && command -v gfortran > /dev/null 2>&1") != 0)
    GTEST_SKIP() << "auto-07p (Debian package auto-07p) is not installed";
  const Oracle oracles[] = {
      {"hardening", {"x", "v"}, {{"-x-0.04*x^3-0.1*v+u", "-x-0.04D0*x**3-0.1D0*v+forcing"}}, 1, 0.9, 1.7, 2},
      {"softening", {"x", "v"}, {{"-x+0.05*x^3-0.1*v+u", "-x+0.05D0*x**3-0.1D0*v+forcing"}}, 0.22, 0.6, 1.2, 2},
      {"1:3",
       {"x", "v", "y", "z"},
       {{"-x-0.02*v-0.1*x^3-0.15*x^2*y-0.1*x*y^2+u", "-x-0.02D0*v-0.1D0*x**3-0.15D0*x**2*y-0.1D0*x*y**2+forcing"},
        {"-9.3*y-0.03*z-0.05*x^3-0.1*x^2*y-0.1*y^3", "-9.3D0*y-0.03D0*z-0.05D0*x**3-0.1D0*x**2*y-0.1D0*y**3"}},
       0.06,
       0.8,
       1.35,
       2}};
  for (const Oracle& o : oracles) {
    std::vector<double> expected = folds_of_auto(o);
    const PeriodicSystem system(model_of(o), {"u", o.force});
    CurveOptions options;
    options.from = o.from;
    options.to = o.to;
    options.harmonics = 13;
    options.most_harmonics = 25;
    options.truncation = 1e-9;
    options.stability = false;
    std::vector<double> found;
    for (const CurveEvent& e : response_curve(system, Parameter::speed, o.force, options).events)
      if (e.kind == EventKind::fold) found.push_back(e.parameter);
    std::sort(found.begin(), found.end());
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(expected.size(), static_cast<std::size_t>(o.folds)) << o.name;
    ASSERT_EQ(found.size(), expected.size()) << o.name;
    for (std::size_t k = 0; k < found.size(); ++k) {
      std::printf("%s: fold %.9f, auto-07p %.9f, relative %.1e\n", o.name, found[k], expected[k],
                  found[k] / expected[k] - 1);
      EXPECT_NEAR(found[k], expected[k], 1e-6 * expected[k]) << o.name;
    }
  }
}

}  // namespace
}  // namespace whirl::response
