#include <vrpipe/platforms/simulation.h>

#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <boost/algorithm/string/classification.hpp>
#include <boost/algorithm/string/split.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/names.h>
#include <vrpipe/component/printable.h>

namespace vrpipe {

const char* name_of(Fidelity fidelity) {
  switch (fidelity) {
    case Fidelity::functional: return "functional";
    case Fidelity::bound: return "bound";
    case Fidelity::lt: return "lt";
    case Fidelity::cycle: return "cycle";
  }
  return "";
}

namespace {
constexpr const char* sampled_name = "sampled";
}  // namespace

const std::vector<Fidelity>& fidelities() {
  static const std::vector<Fidelity> all{Fidelity::functional, Fidelity::bound, Fidelity::lt, Fidelity::cycle};
  return all;
}

namespace {
/// @param names  all that may stand there
Fidelity fidelity_among(const std::string& name, const std::vector<std::string>& names) {
  for (const Fidelity fidelity : fidelities()) {
    if (name == name_of(fidelity)) return fidelity;
  }
  throw UserError("unknown fidelity '" + name + "'", "--fidelity", "this build has no such fidelity",
                  suggestion(name, names));
}
}  // namespace

Fidelity fidelity_named(const std::string& name) {
  std::vector<std::string> names = fidelity_names();
  names.pop_back();  // which is none of a whole run's
  return fidelity_among(name, names);
}

std::vector<std::string> fidelity_names() {
  std::vector<std::string> names;
  for (const Fidelity fidelity : fidelities()) names.emplace_back(name_of(fidelity));
  names.emplace_back(sampled_name);
  return names;
}

void choose_fidelity(RunRequest& request, const std::string& text) {
  std::vector<std::string> words;
  boost::split(words, text, boost::is_any_of(","));
  request.units_at_cycle.clear();
  request.sampling.reset();
  if (words.front() == sampled_name) {
    if (words.size() > 1) {
      throw UserError("unknown fidelity '" + text + "'", "--fidelity", "a sampled run has no units at another fidelity",
                      "write sampled alone");
    }
    request.fidelity = Fidelity::cycle;
    request.sampling.emplace();
    return;
  }
  request.fidelity = fidelity_among(words.front(), fidelity_names());
  for (auto word = words.begin() + 1; word != words.end(); ++word) {
    const std::size_t sign = word->find('=');
    if (request.fidelity != Fidelity::lt || sign == std::string::npos || word->substr(sign + 1) != "cycle") {
      throw UserError("unknown fidelity of a unit '" + *word + "'", "--fidelity " + text,
                      "units can be at cycle among others at lt", "write UNIT=cycle behind lt, as in lt,crop=cycle");
    }
    request.units_at_cycle.push_back(word->substr(0, sign));
  }
}

bool has_time(Fidelity fidelity) { return fidelity != Fidelity::functional && fidelity != Fidelity::bound; }
bool has_course(const RunRequest& request) { return has_time(request.fidelity) && !request.sampling; }

RunRequest as_taken(const RunRequest& request, const std::optional<WayReport>& way) {
  RunRequest taken = request;
  if (!way) return taken;
  const Sampling asked = request.sampling.value_or(Sampling());
  choose_fidelity(taken, way->fidelity);
  if (taken.sampling) taken.sampling->seed = asked.seed;
  return taken;
}

std::string fidelity_of(const RunRequest& request) {
  if (request.sampling) return sampled_name;
  std::string text = name_of(request.fidelity);
  if (request.fidelity != Fidelity::lt || !request.variant.is_of_pipeline()) return text;
  for (const std::string& unit : request.units_at_cycle) text += "," + unit + "=cycle";
  return text;
}

namespace {
std::vector<Variant>& variant_list() {
  static std::vector<Variant> all{{"baseline", false, false},
                                  {"qm", true, false},
                                  {"het", false, true},
                                  {"het+qm", true, true}};
  return all;
}
}  // namespace

const std::string& name_of(const RunRequest& request) {
  return request.name.empty() ? request.variant.name : request.name;
}

const std::vector<Variant>& variants() { return variant_list(); }

const std::vector<Variant>& more_variants() {
  // A splat's program of 76 instructions, since without a lock a warp takes 5.1 cycles of a GH100's 4 SMs, of 4 schedulers
  // each: 24 as with a colour ROP, and address, load, blend and store. Colours do not pass PROP: its widest path is no limit.
  static const auto in_shader = [](const char* name, const char* lock) {
    Variant variant;
    variant.name = name;
    variant.changed_units = {{"crop", "in-shader"}};
    variant.changed_settings = {{"crop", "lock", lock},
                                {"sm", "fragment_instructions", "76"},
                                {"prop", "color_bytes_per_cycle", "256"}};
    return variant;
  };
  const auto outside = [](const char* name, DrawnBy drawn_by) {
    Variant variant;
    variant.name = name;
    variant.drawn_by = drawn_by;
    return variant;
  };
  static const std::vector<Variant> all{in_shader("in-shader", "ordered"), in_shader("in-shader-no-lock", "none"),
                                        outside("software", DrawnBy::software),
                                        outside("accelerator", DrawnBy::accelerator)};
  return all;
}

void add_variant(Variant variant) {
  const auto has_name = [&](const Variant& each) { return each.name == variant.name; };
  const bool taken = std::any_of(variants().begin(), variants().end(), has_name) ||
                     std::any_of(more_variants().begin(), more_variants().end(), has_name);
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    if (!is_loading_plugin())
      throw UserError("cannot add variant '" + printable(variant.name) + "'", "add_variant", why, remedy);
    Registry::instance().add_problem({"variant '" + printable(variant.name) + "': " + why, remedy});
  };
  if (taken) return refuse("there is one of that name", "choose another name");
  if (!is_good_name(variant.name))
    return refuse(std::string("its name is not ") + good_name_rule, "choose another name");
  for (std::size_t i = 0; i < variant.settings.size(); ++i) {
    const Setting& setting = variant.settings[i];
    const auto is_same = [&](const Setting& other) {
      return other.unit == setting.unit && other.parameter == setting.parameter;
    };
    if (std::any_of(variant.settings.begin(), variant.settings.begin() + static_cast<std::ptrdiff_t>(i), is_same))
      return refuse("it sets " + setting.unit + "." + setting.parameter + " twice", "set it once");
  }
  variant_list().push_back(std::move(variant));
  Registry::instance().count_registration();
}

const Variant& variant_named(const std::string& name) {
  std::vector<std::string> names;
  for (const std::vector<Variant>* const list : {&variants(), &more_variants()}) {
    for (const Variant& variant : *list) {
      if (variant.name == name) return variant;
      names.push_back(variant.name);
    }
  }
  throw UserError("unknown variant '" + name + "'", "--variant", "there is no such variant", suggestion(name, names));
}

}  // namespace vrpipe
