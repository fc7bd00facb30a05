// What a frame does not call for changes nothing: `auto` has the result of `all`, always.
#include <vrpipe/platforms/wiring.h>
#include <vrpipe/workloads/multi_pass.h>

#include "scenes.h"
#include "support/mixed_frames.h"

namespace vrpipe {
namespace {

using testing::bins;
using testing::drawn_request;
using testing::mixed_frame;
using testing::random_frame;
using testing::scene;
using testing::whole;

rc::Gen<Fidelity> fidelity() { return rc::gen::elementOf(fidelities()); }

/// Sizes, queues and switches on which effects depend.
std::vector<Setting> settings(ColorFormat format) {
  std::vector<Setting> all = *bins();
  const auto maybe = [&](const char* unit, const char* parameter, const rc::Gen<const char*>& value) {
    if (*whole(0, 3) == 0) all.push_back({unit, parameter, *value});
  };
  maybe("tc", "idle_timeout_cycles", rc::gen::element("0", "1", "20", "100000"));
  maybe("crop", "forwarding", rc::gen::just("off"));
  maybe("crop", "previous_alpha_check", rc::gen::element("on", "off"));
  maybe("raster", "hi_z", rc::gen::just("off"));
  maybe("draw", "warps_per_1024_cycles", rc::gen::element("4", "1024"));
  maybe("zrop", "fast_clear", rc::gen::element("on", "off"));
  maybe("state", "subpixel_bits", rc::gen::element("4", "12"));
  maybe("state", "blend_rounding", testing::rounding(format));
  maybe("state", "splat_extent", rc::gen::element("aabb", "three_sigma", "fill_rectangle"));
  maybe("crop", "cache_bytes", rc::gen::element("2048", "4096"));
  for (const char* link : {"prop.release", "prop.late", "tc.bins", "qru.warps", "crop.terminations", "raster.quads"}) {
    if (*whole(0, 8) == 0) all.push_back({std::string("link.") + link, "depth", *rc::gen::element("1", "2")});
  }
  return all;
}

/// A platform of the catalogue, or one with a DRAM that refreshes within a small frame, or with ports that others leave open.
struct Machine {
  std::shared_ptr<const Platform> own;
  const Platform* platform = nullptr;
  std::vector<Setting> settings;
};
Machine machine() {
  Machine made;
  made.platform = &platforms()[static_cast<std::size_t>(*whole(0, static_cast<int>(platforms().size())))];
  const bool has_dram = made.platform->name.find("lpddr") != std::string::npos;
  if (has_dram && *whole(0, 2) == 0) made.settings = {{"dram", "trefi_ps", "1000000"}};
  if (has_dram || *whole(0, 2) == 0) return made;
  auto own = std::make_shared<Platform>(*made.platform);
  own->wire = [wire = own->wire](Netlist& netlist) {
    wire(netlist);
    connect_attribute_traffic(netlist);
    connect_depth_stencil_traffic(netlist);
  };
  made.own = own;
  made.platform = made.own.get();
  return made;
}

RunResult run(RunRequest request, const Frame& frame, const EffectChoice& choice) {
  request.effects = choice;
  fresh_simulation();
  return simulate(request, frame);
}

/// Depth, stencil and terminations, where they are stored.
bool same_depth_stencil(const Frame& frame, const DepthStencilSurface& a, const DepthStencilSurface& b) {
  for (std::size_t place = 0; place < a.grid().quads(); ++place) {
    if (a.terminated(place) != b.terminated(place)) return false;
    if (!frame.tests_depth_stencil()) continue;
    if (a.quad(place).depth != b.quad(place).depth || a.quad(place).stencil != b.quad(place).stencil) return false;
  }
  return true;
}

/// In words, with the effects that make the difference.
std::string blamed(const RunRequest& request, const Frame& frame, const RunResult& automatic) {
  std::string text = request.platform->name + " " + request.variant.name + " " + name_of(request.fidelity) + " " +
                     name_of(request.format) + " " + name_of(request.termination) + ", stalls of seed " +
                     std::to_string(request.stall_per_256 > 0 ? request.stall_seed : 0);
  for (const Setting& setting : request.settings)
    text += " " + setting.unit + "." + setting.parameter + "=" + setting.value;
  for (const EffectReport& report : automatic.effects) {
    if (!report.omitted) continue;
    EffectChoice choice;
    choice.with = {report.name};
    if (run(request, frame, choice).result_hash != automatic.result_hash)
      text += "\n" + report.name + ": " + report.reason;
  }
  return text;
}

void expect_no_difference(const RunRequest& request, const Frame& frame) {
  const RunResult automatic = run(request, frame, {});
  const RunResult all = run(request, frame, EffectChoice::everything());
  unsigned omitted = 0;
  for (const EffectReport& report : automatic.effects) omitted += report.omitted ? 1 : 0;
  for (const EffectReport& report : all.effects) RC_ASSERT(!report.omitted);
  RC_ASSERT(omitted > 0U);
  if (automatic.result_hash != all.result_hash) RC_LOG() << blamed(request, frame, automatic) << "\n";
  RC_ASSERT(automatic.counts.named() == all.counts.named());
  RC_ASSERT(automatic.cycles == all.cycles);
  RC_ASSERT(automatic.result_hash == all.result_hash);
  RC_ASSERT(same_depth_stencil(frame, automatic.framebuffer.depth_stencil, all.framebuffer.depth_stencil));
  RC_ASSERT(automatic.draws.size() == all.draws.size());
  for (std::size_t draw = 0; draw < all.draws.size(); ++draw)
    RC_ASSERT(automatic.draws[draw].counts == all.draws[draw].counts);
}

RunRequest any_request(const Machine& machine) {
  RunRequest request = drawn_request();
  request.fidelity = *fidelity();
  request.platform = machine.platform;
  request.termination = *rc::gen::element(Termination::paper, Termination::strict);
  const bool has_time = request.fidelity != Fidelity::functional && request.fidelity != Fidelity::bound;
  if (has_time && *whole(0, 3) == 0) {
    request.stall_seed = static_cast<std::uint64_t>(*whole(1, 1000));
    request.stall_per_256 = 64;
  }
  request.settings = settings(request.format);
  request.settings.insert(request.settings.end(), machine.settings.begin(), machine.settings.end());
  return request;
}

RC_GTEST_PROP(Effects, ThatSplatsDoNotCallForChangeNothing, ()) {
  const Machine made = machine();
  const RunRequest request = any_request(made);
  const Draw draw = *scene(40, *rc::gen::element(1.0F, 0.05F, 70000.0F));
  const auto passes = static_cast<std::uint32_t>(*whole(1, 4));
  const bool in_passes = *whole(0, 4) == 0 && draw.splats.size() >= passes;
  const auto frame =
      in_passes ? multi_pass_frame(draw, draw_state_of(request), passes) : Frame::of(draw, draw_state_of(request));
  expect_no_difference(request, *frame);
}

RC_GTEST_PROP(Effects, ThatFramesOfManyDrawsDoNotCallForChangeNothing, ()) {
  const Machine made = machine();
  const RunRequest request = any_request(made);
  const auto seed = static_cast<std::uint64_t>(*whole(1, 1 << 20));
  expect_no_difference(request, *whole(0, 3) == 0 ? mixed_frame(seed, request) : random_frame(seed, request));
}

}  // namespace
}  // namespace vrpipe
