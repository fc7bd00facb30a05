#include "walk/walk_case.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/arithmetic/blend.h>
#include <vrpipe/arithmetic/random.h>
#include <vrpipe/pipeline/effects.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/foreign_memory.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/wiring.h>
#include <vrpipe/workloads/multi_pass.h>

#include "support/builders.h"
#include "support/foreign_memory.h"
#include "support/mixed_frames.h"
#include "support/random_choices.h"

namespace vrpipe::walk {

namespace {

using testing::bounds_of;
using testing::Dice;
using testing::draw_of;
using testing::names_of;
using testing::round_splat;
using testing::splat_at;

// Scenes.

constexpr std::uint32_t most_splats = 800;
constexpr std::uint32_t most_splats_times_pixels = 1500000;

std::uint32_t splat_count(Dice& dice, std::uint32_t width, std::uint32_t height) {
  const std::uint32_t most = std::min(most_splats, most_splats_times_pixels / (width * height));
  return static_cast<std::uint32_t>(std::exp(dice.real(0.0, std::log(most + 1.0))));
}

/// Splats on pixel and tile boundaries, degenerate, huge, and of opacities about the pruning threshold.
Splat odd_splat(Dice& dice, float width, float height) {
  constexpr float one_255th = 1.0F / 255.0F;
  const auto coordinate = [&](float side) {
    const float odd[] = {0.0F, 0.5F, 8.0F, 15.5F, 16.0F, side - 0.5F, side, 1e-40F, -3000.0F, 33000.0F, -1e6F};
    return dice.chance(50) ? dice.real(-4.0F, side + 4.0F) : dice.one_of(odd);
  };
  const float sigmas[] = {0.0F, 1e-6F, 0.3F, 0.5477F, 1.0F, 2.0F, 4.0F, 16.0F, 300.0F, 1e5F};
  const float opacities[] = {
      one_255th, std::nextafter(one_255th, 0.0F), std::nextafter(one_255th, 1.0F), 0.0F, 1.0F / 18.0F, 0.5F, 0.99F,
      1.0F};
  const float colors[] = {0.0F, 1.0F, 0.5F, 6e-8F, 300.0F, 65504.0F, 1e6F};
  // One by one: the order in which arguments are evaluated is the compiler's choice.
  const float x = coordinate(width);
  const float y = coordinate(height);
  const float sigma_a = dice.one_of(sigmas);
  const float sigma_b = dice.one_of(sigmas);
  const float angle = dice.chance(50) ? 0.0F : dice.real(0.0F, 6.28F);
  const float red = dice.one_of(colors);
  const float green = dice.one_of(colors);
  const float opacity = dice.one_of(opacities);
  Splat splat = splat_at(x, y, sigma_a, sigma_b, angle, std::fmax(opacity, one_255th), red, green, 1.0F);
  splat.opacity = opacity;
  return splat;
}

/// What a trained scene shows in a window of its image, thinned out.
Draw thin_window_of(const Draw& real, Dice& dice, std::uint32_t width, std::uint32_t height, std::uint32_t count) {
  const std::uint32_t x = dice.below(real.width - width + 1);
  const std::uint32_t y = dice.below(real.height - height + 1);
  Draw window = testing::window_of(real, x, y, width, height);
  const std::size_t step = window.splats.size() / std::max(1U, count) + 1;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < window.splats.size(); i += step) window.splats[kept++] = window.splats[i];
  window.splats.resize(kept);
  return window;
}

Draw draw_scene(Dice& dice, const Draw& real) {
  const std::uint32_t sides[] = {1, 2, 15, 16, 17, 31, 33, 48, 64, 100};
  const std::uint32_t width = dice.one_of(sides);
  const std::uint32_t height = dice.one_of(sides);
  const auto w = static_cast<float>(width);
  const auto h = static_cast<float>(height);
  const std::uint32_t count = splat_count(dice, width, height);
  Draw draw = draw_of(width, height);
  switch (dice.below(8)) {
    case 0:
    case 1:  // a wall, behind which everything terminates
      for (std::uint32_t i = 0; i < 8; ++i) draw.splats.push_back(round_splat(w / 2, h / 2, 3 * (w + h), 0.99F));
      [[fallthrough]];
    case 2:
    case 3: {
      const Draw behind = testing::random_draw(width, height, count, dice.next());
      draw.splats.insert(draw.splats.end(), behind.splats.begin(), behind.splats.end());
      return draw;
    }
    case 4:  // a stack that rounding keeps below the threshold
      for (std::uint32_t i = 0; i < count; ++i) {
        const float sigma = dice.real(0.5F, 40.0F);
        draw.splats.push_back(round_splat(w / 2, h / 2, sigma, dice.real(0.004F, 0.06F)));
      }
      return draw;
    case 5:
      for (std::uint32_t i = 0; i < count; ++i) draw.splats.push_back(odd_splat(dice, w, h));
      return draw;
    case 6: return thin_window_of(real, dice, width, height, count);
    default:  // one splat or none
      if (dice.chance(80)) draw.splats.push_back(round_splat(w / 2, h / 2, dice.real(0.3F, 20.0F), 0.9F));
      return draw;
  }
}

// Values.

std::string text_of(double value) { return fmt::format("{}", value); }

std::string whole_value(Dice& dice, double low, double high, double usual) {
  // Bytes a cycle between those of whole quads.
  constexpr double between[] = {0.75, 1.125, 1.25, 1.5};
  double value = usual;
  switch (dice.below(7)) {
    case 0: value = low; break;
    case 1: value = high; break;
    case 2: value = low + 1; break;
    case 3: value = usual * (dice.chance(50) ? 2 : 0.5); break;
    case 4: value = std::exp2(std::round(dice.real(0.0, std::log2(high)))); break;
    case 5: value = usual * dice.one_of(between); break;
    default: value = std::exp(dice.real(std::log(low + 1), std::log(high + 1))) - 1; break;
  }
  return fmt::format("{:.0f}", std::min(high, std::max(low, std::floor(value))));
}

std::string real_value(Dice& dice, double low, double high, double usual) {
  switch (dice.below(5)) {
    case 0: return text_of(low);
    case 1: return text_of(high);
    case 2: return text_of(usual);
    case 3: return text_of(high * std::exp(-dice.real(0.0, 12.0)));
    default: return text_of(dice.real(low, high));
  }
}

std::string allowed_value(Dice& dice, const Parameter& parameter) {
  double low = 0;
  double high = 0;
  if (dynamic_cast<const Switch*>(&parameter) != nullptr) return dice.chance(50) ? "on" : "off";
  if (dynamic_cast<const Choice*>(&parameter) != nullptr) return dice.one_of(names_of(parameter));
  if (!bounds_of(parameter, low, high)) throw std::logic_error("no bounds in " + parameter.range());
  const double usual = std::stod(parameter.default_value());
  return dynamic_cast<const Integer*>(&parameter) != nullptr ? whole_value(dice, low, high, usual)
                                                             : real_value(dice, low, high, usual);
}

std::string refused_value(Dice& dice, const Parameter& parameter) {
  double low = 0;
  double high = 0;
  if (dice.chance(50) && bounds_of(parameter, low, high)) {
    if (dynamic_cast<const Integer*>(&parameter) != nullptr) {
      return fmt::format("{:.0f}", dice.chance(50) ? low - 1 : high + 1);
    }
    constexpr double infinity = std::numeric_limits<double>::infinity();
    return text_of(dice.chance(50) ? std::nextafter(low, -infinity) : std::nextafter(high, infinity));
  }
  const char* const nonsense[] = {"", " ", "nan", "inf", "-1", "1e99", "0x10", "on ", "1,5", "99999999999999999999"};
  return dice.one_of(nonsense);
}

/// Whether the platform has a unit of the slot and kind (most have an L2 alone), or does without and says so.
bool is_of(const Platform& platform, const ParameterListing& listing) {
  Netlist netlist(platform.gpcs);
  platform.wire(netlist);
  const std::vector<std::string>& absent = netlist.absent();
  if (std::find(absent.begin(), absent.end(), listing.unit) != absent.end())
    return listing.implementation == Registry::instance().slot(listing.unit).implementation;
  return testing::has_unit(netlist, listing);
}

/// Whether a machine can hold it: some declared maxima fit only one at a time.
bool fits(const Platform& platform, const std::vector<Setting>& settings) {
  std::map<std::string, double> value;
  for (const ParameterListing& listing : list_parameters(&platform)) {
    if (listing.pass_through || !is_of(platform, listing)) continue;
    for (const Parameter* parameter : listing.parameters->parameters()) {
      char* end = nullptr;
      const std::string text = parameter->value();
      const double number = std::strtod(text.c_str(), &end);
      if (*end == '\0') value[listing.unit + "." + parameter->name()] = number;
    }
  }
  for (const Setting& setting : settings) {
    value[setting.unit + "." + setting.parameter] = std::strtod(setting.value.c_str(), nullptr);
  }
  return value["tc.bins"] * value["tc.bin_quads"] <= 1 << 20 &&
         value["tgc.bins"] * value["tgc.bin_primitives"] <= 1 << 20 && value["platform.gpcs"] <= 8;
}

std::vector<Setting> draw_settings(Dice& dice, const Platform& platform, bool& refused) {
  std::vector<std::pair<std::string, const Parameter*>> all;
  const std::vector<ParameterListing> listings = list_parameters(&platform);
  for (const ParameterListing& listing : listings) {
    if (listing.pass_through || !is_of(platform, listing)) continue;
    for (const Parameter* parameter : listing.parameters->parameters()) all.emplace_back(listing.unit, parameter);
  }
  const unsigned counts[] = {0, 1, 1, 1, 1, 2, 2, 3, 4, 7};
  std::vector<Setting> settings;
  for (unsigned count = dice.one_of(counts); count > 0; --count) {
    const auto& [unit, parameter] = dice.one_of(all);
    settings.push_back({unit, parameter->name(), allowed_value(dice, *parameter)});
    if (!fits(platform, settings)) settings.pop_back();
  }
  const char* const some_gpcs[] = {"2", "3", "4", "7"};
  if (dice.chance(10)) settings.push_back({"platform", "gpcs", dice.one_of(some_gpcs)});
  refused = dice.chance(3);
  if (refused) {
    const auto& [unit, parameter] = dice.one_of(all);
    settings.push_back({unit, parameter->name(), refused_value(dice, *parameter)});
  }
  return settings;
}

// Frames.

Setting draw_own_setting(Dice& dice) {
  switch (dice.below(3)) {
    case 0: return {"state", "pruning_threshold", text_of(dice.chance(30) ? 0.0 : dice.real(0.0, 0.3))};
    case 1: return {"state", "termination_threshold", text_of(dice.real(0.3, 1.0))};
    default:
      return {"state", "splat_extent", dice.chance(50) ? "aabb" : dice.chance(50) ? "three_sigma" : "fill_rectangle"};
  }
}

std::vector<Part> draw_parts(Dice& dice, std::size_t splats) {
  std::vector<Part> parts;
  if (!dice.chance(45)) return parts;
  const bool differ = dice.chance(60);
  const bool clears = dice.chance(40);
  const unsigned count = 2 + dice.below(4);
  std::vector<std::uint32_t> cuts{0};
  for (unsigned i = 1; i < count; ++i) cuts.push_back(dice.below(splats + 1));
  std::sort(cuts.begin(), cuts.end());
  for (const std::uint32_t first : cuts) {
    Part& part = parts.emplace_back();
    part.first = first;
    if (differ && dice.chance(50)) part.own.push_back(draw_own_setting(dice));
    if (differ) part.terminates_early = !dice.chance(20);
    if (clears && dice.chance(60)) part.clear = {dice.chance(60), dice.chance(60)};
  }
  return parts;
}

void draw_stencils(Dice& dice, std::vector<Part>& parts) {
  if (!dice.chance(60)) return;
  const StencilOperation operations[] = {StencilOperation::increment_wrap, StencilOperation::replace,
                                         StencilOperation::invert, StencilOperation::zero};
  for (Part& part : parts) {
    part.stencil = static_cast<Part::Stencil>(dice.below(4));
    if (part.stencil == Part::Stencil::written_late) part.operation = dice.one_of(operations);
    part.clear.stencil = dice.chance(25);
    part.clear.stencil_value = 5;
  }
}

bool has_instance(const Netlist& netlist, const std::string& path) {
  return std::any_of(netlist.instances().begin(), netlist.instances().end(),
                     [&](const Instance& instance) { return instance.path == path; });
}

constexpr unsigned other_memories = 12;

/// A DRAM that another project wrote, in one of the styles that TLM-2.0 leaves it.
ForeignMemory other_memory(unsigned which, const std::string& name) {
  const auto ns = [](double nanoseconds) { return sc_core::sc_time(nanoseconds, sc_core::SC_NS); };
  const double accept[] = {0.3, 1, 20};
  auto dram =
      std::make_unique<foreign::Dram>(name.c_str(), ns(accept[which % 3]), ns(40), ns(which % 2 == 0 ? 70 : 900));
  if (which / 3 % 2 == 1) dram->wait_for_end_resp();
  if (which / 6 % 2 == 1) dram->take_one_at_a_time();
  tlm::tlm_base_target_socket_b<32>& socket = dram->socket;
  return {std::move(dram), {&socket}};
}

void edit(Netlist& netlist, const Edits& edits) {
  if (edits.z_caches) connect_depth_stencil_traffic(netlist);
  if (edits.l1s) {
    connect_attribute_traffic(netlist);
    insert_l1(netlist);
  }
  for (unsigned gpc = 0; edits.tallies && gpc < netlist.gpcs(); ++gpc) {
    const std::string self = "gpc" + std::to_string(gpc) + ".";
    if (has_instance(netlist, self + "tally")) continue;
    netlist.insert(self + "raster.out_quads", self + "tally", "tally", "in_quads", "out_quads");
  }
  if (edits.other_memory == 0 || has_instance(netlist, "dram") || !has_instance(netlist, "l2")) return;
  netlist.add_memory("dram", [which = edits.other_memory](const std::string& name, unsigned) {
    return other_memory(which, name);
  });
  netlist.connect_memory("l2", "dram");
}

/// A platform that is edited keeps its name and stays where it is.
const Platform& edited(const Platform& platform, const Edits& edits) {
  static std::map<std::pair<std::string, Edits>, Platform> made;
  const auto [at, is_new] = made.emplace(std::pair{platform.name, edits}, platform);
  if (is_new) {
    at->second.wire = [wire = platform.wire, edits](Netlist& netlist) {
      wire(netlist);
      edit(netlist, edits);
    };
  }
  return at->second;
}

/// A slot of one's own, and the links around it.
void draw_tally(Dice& dice, std::vector<Setting>& settings) {
  const char* const few[] = {"1", "2", "8", "64"};
  const char* const many[] = {"1", "3", "8", "15", "100", "5000"};
  if (dice.chance(60)) settings.push_back({"tally", "beats_per_cycle", dice.one_of(few)});
  for (const char* link : {"link.raster.quads", "link.tally.quads"}) {
    for (const char* parameter : {"depth", "latency_cycles"})
      if (dice.chance(50)) settings.push_back({link, parameter, dice.one_of(many)});
  }
}

/// Caches and queues in which everybody waits for everybody.
void draw_small_z_cache(Dice& dice, std::vector<Setting>& settings) {
  const char* const bytes[] = {"128", "256", "1024", "16384"};
  const char* const few[] = {"1", "2", "5", "64"};
  settings.push_back({"zrop", "cache_bytes", dice.one_of(bytes)});
  for (const char* parameter : {"mshrs", "input_quads", "input_updates", "sectors_per_cycle"}) {
    if (dice.chance(50)) settings.push_back({"zrop", parameter, dice.one_of(few)});
  }
}

/// The same for L1s, whose arrays most often have none of their own.
void draw_l1(Dice& dice, std::vector<Setting>& settings) {
  if (dice.chance(80)) settings.push_back({"sm", "l1_bytes", "0"});
  const char* const bytes[] = {"512", "1024", "16384", "1048576"};
  const char* const few[] = {"1", "2", "5", "64"};
  settings.push_back({"l1", "bytes", dice.one_of(bytes)});
  settings.push_back({"l1", "ways", "2"});
  settings.push_back({"l1", "banks", dice.chance(50) ? "1" : "2"});
  for (const char* parameter : {"mshrs", "write_backs", "port_requests", "latency_cycles"}) {
    if (dice.chance(50)) settings.push_back({"l1", parameter, dice.one_of(few)});
  }
  if (dice.chance(30)) settings.push_back({"l1", "write_policy", "write-back"});
  if (dice.chance(30)) settings.push_back({"l1", "write_allocate", "byte-mask"});
}

/// Banks of the L2 and channels of the DRAM of any number, and as many sets as the banks divide.
void draw_memory_counts(Dice& dice, const Platform& platform, std::vector<Setting>& settings) {
  constexpr unsigned counts[] = {1, 3, 5, 6, 10, 11, 12, 24, 40, 48, 63};
  constexpr unsigned sets_of_a_bank[] = {1, 3, 32, 100};
  for (const ParameterListing& listing : list_parameters(&platform)) {
    if (listing.pass_through || !is_of(platform, listing)) continue;
    if (listing.unit == "l2" && listing.implementation == "sectored-cache") {
      const unsigned banks = dice.one_of(counts);
      const unsigned sets = banks * dice.one_of(sets_of_a_bank);
      settings.push_back({"l2", "banks", std::to_string(banks)});
      settings.push_back({"l2", "bytes", std::to_string(sets * 16 * 128)});
      if (dice.chance(50)) settings.push_back({"l2", "hash_sets", "on"});
    }
    if (listing.unit == "dram") settings.push_back({"dram", "channels", std::to_string(dice.one_of(counts))});
  }
}

/// As for `--effects`.
std::string draw_effects(Dice& dice) {
  if (dice.chance(50)) return "all";
  std::string list = "auto";
  const unsigned percent = dice.one_of(std::array{5U, 20U, 60U});
  for (const Effect& effect : effects()) {
    if (dice.chance(percent)) list += "," + effect.full_name();
  }
  return list;
}

const char* word_for(Termination termination) { return termination == Termination::strict ? "strict" : "paper"; }

}  // namespace

RunRequest Case::request(Fidelity fidelity) const {
  RunRequest r;
  r.platform = platform;
  r.variant = variant;
  r.fidelity = fidelity;
  r.format = format;
  r.termination = termination;
  r.settings = settings;
  r.units = units;
  return r;
}

Frame Case::frame(std::size_t from) const {
  if (mixed_seed != 0) {
    const RunRequest own = request(Fidelity::functional);
    return mixed_seed % 4 == 0 ? testing::mixed_frame(mixed_seed, own) : testing::random_frame(mixed_seed, own);
  }
  Frame frame(draw.width, draw.height);
  const std::shared_ptr<const Draw> scene(&draw, [](const Draw*) {});
  if (parts.empty()) draw_in_passes(frame, scene, draw_state_of(request(Fidelity::functional)), passes);
  const auto splats = static_cast<std::uint32_t>(draw.splats.size());
  for (std::size_t i = from; i < parts.size(); ++i) {
    const Part& part = parts[i];
    if (part.clear.color || part.clear.termination || part.clear.stencil) frame.clear(part.clear);
    DrawState state = draw_state_of(request(Fidelity::functional), part.own);
    state.early_termination = part.terminates_early;
    state.stencil.test = part.stencil != Part::Stencil::untested;
    state.late_tests = part.stencil == Part::Stencil::read_late || part.stencil == Part::Stencil::written_late;
    state.stencil.front.pass = part.operation;
    if (state.stencil.test) state.stencil.front.reference = static_cast<std::uint8_t>(i);
    const std::uint32_t first = i == 0 ? 0 : std::min(part.first, splats);
    const std::uint32_t end = i + 1 < parts.size() ? std::min(parts[i + 1].first, splats) : splats;
    frame.draw(scene, state, fmt::format("part {}", i), first, end - first);
  }
  return frame;
}

bool Case::is_mere_split() const {
  return std::all_of(parts.begin(), parts.end(), [](const Part& part) {
    return part.own.empty() && part.terminates_early && !part.clear.color && !part.clear.termination &&
           !part.clear.stencil && part.stencil == Part::Stencil::untested;
  });
}

const Platform& simplest_platform() { return platform_named("agx-orin-ideal-memory"); }

Case draw_case(std::uint64_t seed, std::uint64_t index, const Draw& real) {
  Dice dice(mix(mix(seed) ^ index));
  Case c;
  c.seed = seed;
  c.index = index;
  const Fidelity timed[] = {Fidelity::lt, Fidelity::cycle};
  c.platform = dice.chance(40) ? &simplest_platform() : &dice.one_of(platforms());
  c.variant = dice.one_of(variants());
  c.format = dice.one_of(color_formats);
  c.termination = dice.chance(40) ? Termination::strict : Termination::paper;
  c.settings = draw_settings(dice, *c.platform, c.refused);
  const auto rounds_as_measured = [](const Setting& setting) {
    return setting.parameter == "blend_rounding" && setting.value == "measured";
  };
  if (!is_measured(c.format) && std::any_of(c.settings.begin(), c.settings.end(), rounds_as_measured))
    c.format = ColorFormat::rgba16f;
  const std::string left_out = dice.chance(50) ? "qru" : "tgc";
  const auto is_set = [&](const Setting& setting) { return setting.unit == left_out; };
  if (dice.chance(4) && std::none_of(c.settings.begin(), c.settings.end(), is_set)) {
    c.units.push_back({left_out, "pass-through"});
  }
  c.repeated = dice.one_of(fidelities());
  c.stalled = dice.one_of(timed);
  c.stall_seed = dice.next() | 1U;
  Dice of_units(mix(mix(seed + 2) ^ index));
  const std::vector<std::string> slots{"draw", "vpo", "tgc", "raster", "tc", "prop", "zrop", "qru", "sm", "crop"};
  c.units_at_cycle.push_back(of_units.one_of(slots));
  c.draw = draw_scene(dice, real);
  c.parts = draw_parts(dice, c.draw.splats.size());
  Dice of_stencils(mix(mix(seed + 1) ^ index));
  draw_stencils(of_stencils, c.parts);
  c.edits.z_caches = dice.chance(40);
  if (c.edits.z_caches && !c.refused && dice.chance(60)) draw_small_z_cache(dice, c.settings);
  c.edits.l1s = dice.chance(25);
  if (c.edits.l1s && !c.refused) draw_l1(dice, c.settings);
  if (c.parts.empty() && c.draw.splats.size() > 1 && dice.chance(25)) {
    c.passes = 2 + dice.below(std::min<std::size_t>(c.draw.splats.size(), 9) - 1);
  }
  Dice of_edits(mix(mix(seed + 3) ^ index));
  c.edits.tallies = of_edits.chance(20);
  if (c.edits.tallies && !c.refused) draw_tally(of_edits, c.settings);
  if (of_edits.chance(15)) c.edits.other_memory = 1 + of_edits.below(other_memories);
  Dice of_memory(mix(mix(seed + 4) ^ index));
  if (of_memory.chance(60) && !c.refused &&
      std::none_of(c.settings.begin(), c.settings.end(),
                   [](const Setting& setting) { return setting.unit == "l2" || setting.unit == "dram"; })) {
    draw_memory_counts(of_memory, *c.platform, c.settings);
  }
  if (c.edits.any()) c.platform = &edited(*c.platform, c.edits);
  if (!c.refused && dice.chance(20)) {
    c.mixed_seed = 1 + dice.below(1000000);
    c.draw = draw_of(testing::mixed_frame_width, testing::mixed_frame_height);
    c.parts.clear();
    c.passes = 1;
  }
  Dice of_effects(mix(mix(seed + 2) ^ index));
  if (!c.refused && of_effects.chance(33)) c.effects = draw_effects(of_effects);
  return c;
}

std::string describe(const Case& c) {
  std::string text = fmt::format("{} {} {} {} {}x{}, {} splats", c.platform->name, c.variant.name, name_of(c.format),
                                 word_for(c.termination), c.draw.width, c.draw.height, c.draw.splats.size());
  if (c.mixed_seed != 0) text += fmt::format(", meshes and splats of seed {},", c.mixed_seed);
  if (c.edits.z_caches) text += ", z-caches connected,";
  if (c.edits.l1s) text += ", L1s inserted,";
  if (c.edits.tallies) text += ", tallies inserted,";
  if (c.edits.other_memory != 0) text += fmt::format(", memory of another make {},", c.edits.other_memory);
  if (c.passes > 1) text += fmt::format(" {} passes", c.passes);
  if (!c.effects.empty()) text += " effects " + c.effects;
  for (const UnitChoice& unit : c.units) text += fmt::format(" {}={}", unit.slot, unit.implementation);
  for (const Setting& setting : c.settings) {
    text += fmt::format(" {}.{}={}", setting.unit, setting.parameter, setting.value);
  }
  for (const Part& part : c.parts) {
    if (part.clear.color || part.clear.termination || part.clear.stencil) {
      text += fmt::format("\n    clear{}{}{}", part.clear.color ? " color" : "",
                          part.clear.termination ? " termination" : "", part.clear.stencil ? " stencil" : "");
    }
    text += fmt::format("\n    draw from splat {} on{}", part.first, part.terminates_early ? "" : ", not terminated");
    for (const Setting& setting : part.own) text += fmt::format(", {}={}", setting.parameter, setting.value);
    const char* const stencils[] = {"", ", stencil tested early", ", stencil tested late",
                                    ", stencil written late by "};
    text += stencils[static_cast<unsigned>(part.stencil)];
    if (part.operation != StencilOperation::keep) text += fmt::format("{}", static_cast<unsigned>(part.operation));
  }
  return text;
}

std::string command_line(const Case& c, Fidelity fidelity, const std::string& scene) {
  std::string line =
      fmt::format("vrpipe run --scene {} --platform {} --variant {} --format {} --termination {} --fidelity {}", scene,
                  c.platform->name, c.variant.name, name_of(c.format), word_for(c.termination), name_of(fidelity));
  if (c.passes > 1) line += fmt::format(" --multi-pass {}", c.passes);
  for (const UnitChoice& unit : c.units) line += fmt::format(" --unit {}={}", unit.slot, unit.implementation);
  for (const Setting& setting : c.settings) {
    line += fmt::format(" --set '{}.{}={}'", setting.unit, setting.parameter, setting.value);
  }
  return line;
}

}  // namespace vrpipe::walk
