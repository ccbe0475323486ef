#include "balance.hpp"

#include <cmath>
#include <numbers>

#include "plant_options.hpp"
#include "whirl/diagnosis/balancing.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::app {

void add_balance(CommandLine& app, Session& session) {
  struct Options {
    PlantOptions plant;
    double radius_mm = 0, speed_rpm = 0, grade = 6.3;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      app, session, "balance", "Mass and angle to add, from the identified eccentricity",
      "Input: model.json of `whirl identify`; the mass of the disk by --mass-kg or --stiffness. One plane. Angles "
      "count from the\n"
      "zero of the record's angle, in its sense of rotation. The grade is G = e omega at the service speed (ISO "
      "21940-11: 2.5\n"
      "for turbines and pumps of high quality, 6.3 for general machines).\n\n"
      "Example: whirl balance model.json --mass-kg 1.5 --radius-mm 83 --speed-rpm 1800",
      [o, &session] {
        tuning::DesignOptions design;
        std::vector<std::filesystem::path> inputs;
        const IdentifiedModel model = o->plant.load(design, inputs);
        if (!model.rotor)
          throw Error(o->plant.model + ": the model has no rotor parameters; identify with --method weak");
        const double mass = 1 / (design.gain > 0 ? design.gain : model.rotor->gain);
        const double omega = o->speed_rpm * std::numbers::pi / 30;
        const diagnosis::BalancingAdvice a =
            diagnosis::balancing_advice(*model.rotor, mass, o->radius_mm * 1e-3, omega, o->grade);
        constexpr double kDegree = 180 / std::numbers::pi;
        session.say(fmt::format("unbalance          {:.4g} g mm, heavy spot at {:.1f} deg", 1e6 * a.unbalance,
                                kDegree * a.heavy_angle));
        session.say(fmt::format("balance quality    G {:.3g} at {:g} rpm; G {:g} asked for: {}", a.grade, o->speed_rpm,
                                o->grade, a.within_grade ? "held, nothing to do" : "not held"));
        session.say(fmt::format("permitted          {:.4g} g mm", 1e6 * a.permitted_unbalance));
        session.say(fmt::format("to add             {:.3g} g at {:g} mm and {:.1f} deg", 1e3 * a.correction_mass,
                                o->radius_mm, kDegree * a.correction_angle));
        session.result(io::Json::object()
                           .set("unbalance_kg_m", a.unbalance)
                           .set("heavy_angle_rad", a.heavy_angle)
                           .set("correction_mass_kg", a.correction_mass)
                           .set("correction_radius_m", o->radius_mm * 1e-3)
                           .set("correction_angle_rad", a.correction_angle)
                           .set("grade_mm_s", a.grade)
                           .set("permitted_unbalance_kg_m", a.permitted_unbalance)
                           .set("within_grade", a.within_grade));
        session.finish(model.summary);
      });
  sub->add_option("MODEL", o->plant.model, "model.json")->input()->required();
  sub->add_option("--mass-kg", o->plant.mass_kg, "mass of the disk");
  sub->add_option("--stiffness", o->plant.stiffness, "stiffness.json of the pull test: gives the mass")->input();
  sub->add_option("--radius-mm", o->radius_mm, "where the mass is added")->required();
  sub->add_option("--speed-rpm", o->speed_rpm, "service speed")->required();
  sub->add_option("--grade", o->grade, "balance quality asked for, mm/s")->show_default();
}

}  // namespace whirl::app
