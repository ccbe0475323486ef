#include "fmu_builder.hpp"

#include <cstdint>

#include "whirl/core/error.hpp"

namespace whirl::deploy {
namespace {

/// FNV-1a over the text, from a given start: the token only has to differ where the content does.
std::uint64_t hash(std::string_view text, std::uint64_t state) {
  for (const char c : text) state = (state ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return state;
}

std::string token_of(const std::string& content) {
  const std::uint64_t a = hash(content, 14695981039346656037ULL), b = hash(content, a ^ 0x9e3779b97f4a7c15ULL);
  return fmt::format("{{{:08x}-{:04x}-{:04x}-{:04x}-{:012x}}}", a >> 32, (a >> 16) & 0xffff, a & 0xffff, b >> 48,
                     b & 0xffffffffffffULL);
}

}  // namespace

void require_fmu(const FmuOptions& o) {
  if (o.version != 2 && o.version != 3) throw Error::in_field("fmi version", std::to_string(o.version), "2 or 3");
  if (!o.co_simulation && !o.model_exchange) throw Error("an FMU needs co-simulation or model exchange");
  if (o.code.single_precision) throw Error("an FMU has double precision: leave out --float");
}

std::vector<SourceFile> finish_fmu(FmuBuilder& b, const FmuOptions& o, TemplateSettings s, const std::string& part,
                                   const SourceFile& header, const SourceFile& source) {
  const std::string& id = o.code.prefix;
  s.prefix = id;
  s.slots["prefix"] = id;
  s.slots["layout"] = b.layout;
  s.slots["pointers"] = b.pointers;
  s.slots["me"] = o.model_exchange ? "true" : "false";
  s.slots["cs"] = o.co_simulation ? "true" : "false";
  // The description without its token names every variable; with the source it is what the token stands for.
  const std::string token = token_of(header.text + source.text + fmu_xml(b.description, o, ""));
  s.slots["token"] = token;
  const char* const version = o.version == 2 ? "fmi2" : "fmi3";
  s.slots["fmi"] = version;
  s.slots["State"] = o.version == 2 ? "FMUstate" : "FMUState";
  s.slots["Deserialize"] = o.version == 2 ? "DeSerialize" : "Deserialize";
  s.slots["Derivatives"] = o.version == 2 ? "GetDerivatives" : "GetContinuousStateDerivatives";
  s.slots["common"] = fill_template(deploy_template("fmi_common.c"), s);
  std::string code = fmt::format("/* {}: FMI {}.0 around {}.c. */\n", id, o.version, id);
  for (const std::string& name : {std::string("fmu_core.c"), part, std::string(version) + ".c"})
    code += fill_template(deploy_template(name), s);
  std::vector<SourceFile> files{
      {"modelDescription.xml", fmu_xml(b.description, o, token)},
      {"sources/" + header.name, header.text},
      {"sources/" + source.name, source.text},
      {"sources/" + id + "_fmu.c", drop_unused_functions(code)},
      {fmt::format("sources/{}.h", version), std::string(deploy_template(std::string(version) + ".h"))}};
  if (o.version == 3) {
    files.push_back(
        {"sources/buildDescription.xml",
         fmt::format(
             "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n"
             "  <BuildConfiguration modelIdentifier=\"{0}\">\n    <SourceFileSet language=\"C99\">\n"
             "      <SourceFile name=\"{0}.c\"/>\n      <SourceFile name=\"{0}_fmu.c\"/>\n    </SourceFileSet>\n"
             "  </BuildConfiguration>\n</fmiBuildDescription>\n",
             id)});
  }
  return files;
}

}  // namespace whirl::deploy
