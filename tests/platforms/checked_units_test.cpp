// Units that are not trusted: each breaks one rule of its slot, and the run ends in a fault that names it, at every
// fidelity.
#include <algorithm>
#include <deque>
#include <stdexcept>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/configuration.h>

#include "crop/crop.h"
#include "draw/draw.h"
#include "prop/prop.h"
#include "qru/qru.h"
#include "raster/raster.h"
#include "sm/sm.h"
#include "support/refusals.h"
#include "support/simulate.h"
#include "tc/tc.h"
#include "tgc/tgc.h"
#include "vpo/vpo.h"
#include "zrop/zrop.h"

namespace vrpipe {
namespace {

using namespace testing;

struct DrawWithoutRate : VertexIssue {
  using VertexIssue::VertexIssue;
  std::uint32_t warps_per_1024_cycles() const override { return 0; }
};
struct DrawBeyondTheSplats : VertexIssue {
  using VertexIssue::VertexIssue;
  bool next(VertexWarp& out) override {
    const bool more = VertexIssue::next(out);
    out.first_splat += 1'000'000;
    return more;
  }
};
struct DrawOverAndOver : VertexIssue {
  using VertexIssue::VertexIssue;
  bool next(VertexWarp& out) override {
    out = VertexWarp{0, 8, 0, Mark::none};
    return true;
  }
};
struct VpoOfThree : PrimitiveAssembly {
  using PrimitiveAssembly::PrimitiveAssembly;
  unsigned assemble(DrawIndex draw, std::uint32_t splat, std::array<Primitive, 2>& out) override {
    PrimitiveAssembly::assemble(draw, splat, out);
    return 3;
  }
};
struct VpoThatThrowsWhenMade : PrimitiveAssembly {
  VpoThatThrowsWhenMade(const Parameters& parameters, const RenderContext& context)
      : PrimitiveAssembly(parameters, context) {
    throw std::runtime_error("no table");
  }
};
struct VpoWithoutRate : PrimitiveAssembly {
  using PrimitiveAssembly::PrimitiveAssembly;
  Throughput timing() const override { return {0, 1}; }
};
struct VpoThatCountsTwice : PrimitiveAssembly {
  using PrimitiveAssembly::PrimitiveAssembly;
  unsigned assemble(DrawIndex draw, std::uint32_t splat, std::array<Primitive, 2>& out) override {
    const unsigned count = PrimitiveAssembly::assemble(draw, splat, out);
    primitives.add(draw, count);
    return count;
  }
};
struct TgcWithoutLatency : TileGridCoalescing {
  using TileGridCoalescing::TileGridCoalescing;
  Throughput timing() const override { return {2, 0}; }
};
struct TgcThatDrainsForEver : TileGridCoalescing {
  using TileGridCoalescing::TileGridCoalescing;
  bool drain(Flush& out) override {
    if (TileGridCoalescing::drain(out)) last_ = out;
    out = last_;
    return true;
  }
  Flush last_;
};
struct TgcThatEntersForEver : TileGridCoalescing {
  using TileGridCoalescing::TileGridCoalescing;
  bool entering() const override { return true; }
  bool step(Flush&) override { return false; }
};
struct RasterOutsideTheFrame : TileRasterizer {
  using TileRasterizer::TileRasterizer;
  bool next(QuadBeat& out, unsigned& coarse_tests, bool& new_screen_tile) override {
    const bool more = TileRasterizer::next(out, coarse_tests, new_screen_tile);
    if (more) out.tile.x = 4000;
    return more;
  }
};
struct RasterThatNeverEnds : TileRasterizer {
  using TileRasterizer::TileRasterizer;
  bool next(QuadBeat& out, unsigned& coarse_tests, bool& new_screen_tile) override {
    if (!TileRasterizer::next(out, coarse_tests, new_screen_tile)) out.count = 0;
    return true;
  }
};
struct TcThatTakesTooMuch : TileCoalescing {
  using TileCoalescing::TileCoalescing;
  unsigned insert(const QuadBeat& beat, unsigned from, Flush& out, bool& flushed) override {
    return TileCoalescing::insert(beat, from, out, flushed) + 1;
  }
};
struct TcThatTakesNothing : TileCoalescing {
  using TileCoalescing::TileCoalescing;
  unsigned insert(const QuadBeat&, unsigned, Flush&, bool& flushed) override {
    flushed = false;
    return 0;
  }
};
struct TcThatThrows : TileCoalescing {
  using TileCoalescing::TileCoalescing;
  unsigned insert(const QuadBeat&, unsigned, Flush&, bool&) override { throw 7; }
};
struct TcThatKeepsQuads : TileCoalescing {
  using TileCoalescing::TileCoalescing;
  bool flush_oldest(FlushReason, Flush&) override { return false; }
};
struct TcOfAnotherPosition : TileCoalescing {
  using TileCoalescing::TileCoalescing;
  bool flush_oldest(FlushReason reason, Flush& out) override {
    const bool flushed = TileCoalescing::flush_oldest(reason, out);
    if (flushed) out.quads.front().position = 64;
    return flushed;
  }
};
struct PropWithoutTime : PreRop {
  using PreRop::PreRop;
  const PropTime& time() const override { throw 7; }
};
struct ZropOfAnotherTile : DepthStencilRop {
  using DepthStencilRop::DepthStencilRop;
  std::uint32_t test(QuadBeat& beat) override {
    const std::uint32_t changed = DepthStencilRop::test(beat);
    ++beat.tile.x;
    return changed;
  }
};
struct ZropThatChangesQuadsThatAreNotThere : DepthStencilRop {
  using DepthStencilRop::DepthStencilRop;
  std::uint32_t test(QuadBeat& beat) override {
    const unsigned count = beat.count;
    DepthStencilRop::test(beat);
    return 1U << count;
  }
};
template <unsigned Count>
struct QruOf : PairingQru {
  using PairingQru::PairingQru;
  unsigned examine(TileId tile, const Quad* quads, unsigned count, Warp& out, bool& launched) override {
    const unsigned examined = PairingQru::examine(tile, quads, count, out, launched);
    if (launched) out.count = Count;
    return examined;
  }
  bool finish_bin(Warp& out) override {
    const bool launched = PairingQru::finish_bin(out);
    if (launched) out.count = Count;
    return launched;
  }
};
struct QruThatNeverFinishes : PairingQru {
  using PairingQru::PairingQru;
  bool finish_bin(Warp& out) override {
    if (PairingQru::finish_bin(out)) last_ = out;
    out = last_;
    return true;
  }
  Warp last_;
};
struct QruOfAnotherSplat : PairingQru {
  using PairingQru::PairingQru;
  bool finish_bin(Warp& out) override {
    const bool launched = PairingQru::finish_bin(out);
    if (launched) out.quads[0].splat = 123'456'789;
    return launched;
  }
};
struct SmWithoutTime : SplatShader {
  using SplatShader::SplatShader;
  const SmTime& time() const override { throw 7; }
};
struct SmThatForgetsAWarp : SplatShader {
  using SplatShader::SplatShader;
  void shade(const Warp& warp, ShadedWarp& out) override {
    SplatShader::shade(warp, out);
    out.count = 0;
  }
};
template <ColorFormat Format, BlendRounding Rounding>
struct CropWithoutTime : ColorRop<Format, Rounding> {
  using ColorRop<Format, Rounding>::ColorRop;
  const CropTime& time() const override { throw 7; }
};
template <ColorFormat Format, BlendRounding Rounding>
struct CropThatKillsTheDead : ColorRop<Format, Rounding> {
  using ColorRop<Format, Rounding>::ColorRop;
  CropBehaviour::Outcome blend(DrawIndex draw, std::size_t place, LaneMask live, const QuadColor& color) override {
    CropBehaviour::Outcome outcome = ColorRop<Format, Rounding>::blend(draw, place, live, color);
    outcome.terminated = 0x1f;
    return outcome;
  }
  void blend_quads(const ShadedWarp& warp, unsigned from, unsigned to, CropBehaviour::Outcomes& outcomes) override {
    CropBehaviour::blend_quads(warp, from, to, outcomes);
  }
};
/// Blends, and counts nothing.
struct CropWithoutCounts : CropBehaviour {
  struct Parameters : CropParameters {};
  CropWithoutCounts(const Parameters& parameters, const RenderContext& context) : rop(parameters, context) {}
  void attach(ColorSurface& surface) override {
    CropBehaviour::attach(surface);
    rop.attach(surface);
  }
  void pass(Mark mark) override { rop.pass(mark); }
  Outcome blend(DrawIndex draw, std::size_t place, LaneMask live, const QuadColor& color) override {
    return rop.blend(draw, place, live, color);
  }
  const CropTime& time() const override { return rop.time(); }
  ColorRop<ColorFormat::rgba16f, BlendRounding::rne> rop;
};

struct Case {
  std::string slot;
  std::string name;
  std::string expected;  ///< in the message, after slot=name
};
std::vector<Case>& cases() {
  static std::vector<Case> all;
  return all;
}

template <class Unit, class SlotBehaviour>
struct Add {
  Add(const char* slot, const char* name, const char* expected) {
    const Registrar<Unit, SlotBehaviour> registrar(slot, name, "breaks a rule");
    cases().push_back({slot, name, expected});
  }
};
struct AddCrop {
  AddCrop(Implementation implementation, const char* expected) {
    cases().push_back({"crop", implementation.name, expected});
    Registry::instance().add(std::move(implementation));
  }
};

const Add<DrawWithoutRate, DrawBehaviour> draw_rate("draw", "no-rate", "warps_per_1024_cycles is 0");
const Add<DrawBeyondTheSplats, DrawBehaviour> draw_splats("draw", "beyond", "next: a warp of splats 1000000");
const Add<DrawOverAndOver, DrawBehaviour> draw_again("draw", "again", "next: a warp of splats 0 to 7, after 8 of");
const Add<VpoOfThree, VpoBehaviour> vpo_three("vpo", "three", "assemble: 3 triangles of splat 0");
const Add<VpoThatThrowsWhenMade, VpoBehaviour> vpo_throws("vpo", "throws", "make_behaviour throws: no table");
const Add<VpoWithoutRate, VpoBehaviour> vpo_rate("vpo", "no-rate", "items_per_cycle is 0");
const Add<VpoThatCountsTwice, VpoBehaviour> vpo_counts("vpo", "counts-twice", "primitives counts");
const Add<TgcWithoutLatency, TgcBehaviour> tgc_latency("tgc", "no-latency", "latency_cycles is 0");
const Add<TgcThatDrainsForEver, TgcBehaviour> tgc_drain("tgc", "drains", "drain: ");
const Add<TgcThatEntersForEver, TgcBehaviour> tgc_enter("tgc", "enters", "step: a primitive is still entering");
const Add<RasterOutsideTheFrame, RasterBehaviour> raster_tile("raster", "outside", "next: screen tile 4000,");
const Add<RasterThatNeverEnds, RasterBehaviour> raster_ends("raster", "endless", "more raster tiles than the frame");
const Add<TcThatTakesTooMuch, TcBehaviour> tc_much("tc", "takes-too-much", "insert: ");
const Add<TcThatTakesNothing, TcBehaviour> tc_nothing("tc", "takes-nothing", "insert: 0 quads taken of");
const Add<TcThatThrows, TcBehaviour> tc_throws("tc", "throws", "insert throws an exception of unknown type");
const Add<TcThatKeepsQuads, TcBehaviour> tc_keeps("tc", "keeps", "flush_oldest: ");
const Add<TcOfAnotherPosition, TcBehaviour> tc_position("tc", "position", "position 64, a tile has 64");
const Add<PropWithoutTime, PropBehaviour> prop_time("prop", "no-time", "time throws");
const Add<ZropOfAnotherTile, ZropBehaviour> zrop_tile("zrop", "other-tile", "test: a beat of screen tile");
const Add<ZropThatChangesQuadsThatAreNotThere, ZropBehaviour> zrop_changes("zrop", "changes-more",
                                                                           "have changed something");
const Add<QruOf<0>, QruBehaviour> qru_0("qru", "warps-of-0", "a warp of 0 quads");
const Add<QruOf<9>, QruBehaviour> qru_9("qru", "warps-of-9", "a warp of 9 quads");
const Add<QruOf<255>, QruBehaviour> qru_255("qru", "warps-of-255", "a warp of 255 quads");
const Add<QruThatNeverFinishes, QruBehaviour> qru_ends("qru", "endless", "finish_bin: a warp of");
const Add<QruOfAnotherSplat, QruBehaviour> qru_splat("qru", "other-splat", "splat 123456789 for draw 0, which has");
const Add<SmWithoutTime, SmBehaviour> sm_time("sm", "no-time", "time throws an exception of unknown type");
const Add<SmThatForgetsAWarp, SmBehaviour> sm_warp("sm", "forgets", "quads_pruned + quads_merged counts");
const Add<CropWithoutCounts, CropBehaviour> crop_counts("crop", "no-counts", "quads_dropped_late counts 0, but");
const AddCrop crop_time(CropMaker<CropWithoutTime>::implementation("no-time", "breaks a rule"),
                        "time throws an exception of unknown type");
const AddCrop crop_dead(CropMaker<CropThatKillsTheDead>::implementation("kills-the-dead", "breaks a rule"),
                        "pixels 0x1f terminated by fragments");
const AddCrop crop_null(
    [] {
      Implementation implementation = CropMaker<ColorRop>::implementation("null", "makes nothing");
      implementation.make_behaviour = [](const ParameterSet&, const RenderContext&) { return nullptr; };
      return implementation;
    }(),
    "make_behaviour makes nothing");

std::string fault_of(const Case& broken, Fidelity fidelity, const Frame& frame) {
  const RunRequest request = request_of("het+qm", fidelity, [&](RunRequest& r) {
    r.units = {{broken.slot, broken.name}};
  });
  fresh_simulation();
  return testing::refusal_of<SimulationFault>([&] { simulate(request, frame); });
}
std::string fault_of(const Case& broken, Fidelity fidelity, const Draw& draw) {
  return fault_of(broken, fidelity, *Frame::of(draw, draw_state_of(request_of("het+qm"))));
}

TEST(CheckedUnits, ABrokenRuleIsAFaultThatNamesTheUnitAtEveryFidelity) {
  const Draw draw = random_draw(100, 60, 200, 1);
  for (const Case& broken : cases()) {
    for (const Fidelity fidelity : fidelities()) {
      SCOPED_TRACE(broken.slot + "=" + broken.name + " at " + name_of(fidelity));
      const std::string fault = fault_of(broken, fidelity, draw);
      EXPECT_EQ(fault.rfind(broken.slot + "=" + broken.name + " at cycle ", 0), 0U) << fault;
      EXPECT_NE(fault.find(broken.expected), std::string::npos) << fault;
    }
  }
}

TEST(CheckedUnits, AFaultNamesTheCycle) {
  const Draw draw = random_draw(100, 60, 200, 1);
  const Case late{"tc", "keeps", ""};
  EXPECT_NE(fault_of(late, Fidelity::functional, draw).find("at cycle 0:"), std::string::npos);
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    EXPECT_EQ(fault_of(late, fidelity, draw).find("at cycle 0:"), std::string::npos) << name_of(fidelity);
  }
}

// In frames of several draws.

/// DRAW whose marks go wrong; commands are told apart from 0 on.
template <class Change>
struct DrawOfOtherMarks : VertexIssue {
  using VertexIssue::VertexIssue;
  bool next(VertexWarp& out) override {
    while (VertexIssue::next(out)) {
      if (out.mark == Mark::none || Change()(out.mark)) return true;
    }
    return false;
  }
};
struct WithoutTheFirst {
  bool operator()(Mark& mark) const { return mark != Frame::mark_of(1); }
};
struct WithoutTheLast {
  bool operator()(Mark& mark) const { return mark != Frame::mark_of(4); }
};
struct TheFirstAgain {
  bool operator()(Mark& mark) const {
    mark = Frame::mark_of(1);
    return true;
  }
};
struct BeyondTheFrame {
  bool operator()(Mark& mark) const {
    mark = Frame::mark_of(70);
    return true;
  }
};
/// Hands on each mark before the warp in front of it.
struct DrawOfEarlyMarks : VertexIssue {
  using VertexIssue::VertexIssue;
  bool next(VertexWarp& out) override {
    if (have_) {
      have_ = false;
      out = kept_;
      return true;
    }
    if (!VertexIssue::next(out)) return false;
    kept_ = out;
    VertexWarp after;
    if (out.mark != Mark::none || out.first_splat != 96 || !VertexIssue::next(after)) return true;
    have_ = true;
    out = after;
    return true;
  }
  VertexWarp kept_;
  bool have_ = false;
};

/// Brings counters to what others of the same names count, all for draw 0.
void count_for_draw_0(StatisticSet& own, const StatisticSet& other) {
  const auto of_name = [](const auto& counters, const std::string& name) {
    return *std::find_if(counters.begin(), counters.end(), [&](const auto* each) { return name == each->name(); });
  };
  for (Counter* counter : own.counters()) {
    const std::uint64_t more = of_name(other.counters(), counter->name())->value() - counter->value();
    const auto& of_draws = own.draw_counters();
    const auto found = std::find(of_draws.begin(), of_draws.end(), counter);
    if (found != of_draws.end()) {
      (*found)->add(0, more);
    } else {
      *counter += more;
    }
  }
}
/// Does as the shipped unit, and counts everything for draw 0.
struct VpoForDraw0 : VpoBehaviour {
  using Parameters = PrimitiveAssembly::Parameters;
  VpoForDraw0(const Parameters& parameters, const RenderContext& context) : unit_(parameters, context) {}
  unsigned assemble(DrawIndex draw, std::uint32_t splat, std::array<Primitive, 2>& out) override {
    const unsigned count = unit_.assemble(draw, splat, out);
    count_for_draw_0(*this, unit_);
    return count;
  }
  Throughput timing() const override { return unit_.timing(); }
  PrimitiveAssembly unit_;
};
struct RasterForDraw0 : RasterBehaviour {
  using Parameters = TileRasterizer::Parameters;
  RasterForDraw0(const Parameters& parameters, const RenderContext& context) : unit_(parameters, context) {}
  void begin(const Primitive& primitive, const PixelRect& clip) override { unit_.begin(primitive, clip); }
  bool next(QuadBeat& out, unsigned& coarse_tests, bool& new_screen_tile) override {
    const bool more = unit_.next(out, coarse_tests, new_screen_tile);
    count_for_draw_0(*this, unit_);
    return more;
  }
  const RasterTime& time() const override { return unit_.time(); }
  TileRasterizer unit_;
};
struct ZropForDraw0 : ZropBehaviour {
  using Parameters = DepthStencilRop::Parameters;
  ZropForDraw0(const Parameters& parameters, const RenderContext& context) : unit_(parameters, context) {}
  void attach(DepthStencilSurface& surface) override { unit_.attach(surface); }
  std::uint32_t test(QuadBeat& beat) override {
    const std::uint32_t changed = unit_.test(beat);
    count_for_draw_0(*this, unit_);
    return changed;
  }
  std::uint32_t test_late(ShadedWarp& warp) override {
    const std::uint32_t changed = unit_.test_late(warp);
    count_for_draw_0(*this, unit_);
    return changed;
  }
  void update(const TerminationSignal& signal) override {
    unit_.update(signal);
    count_for_draw_0(*this, unit_);
  }
  void pass(Mark mark) override { unit_.pass(mark); }
  void follow(FunctionalRunAhead& run_ahead) override { unit_.follow(run_ahead); }
  const ZropTime& time() const override { return unit_.time(); }
  DepthStencilRop unit_;
};
struct SmForDraw0 : SmBehaviour {
  using Parameters = SplatShader::Parameters;
  SmForDraw0(const Parameters& parameters, const RenderContext& context) : unit_(parameters, context) {}
  void shade(const Warp& warp, ShadedWarp& out) override {
    unit_.shade(warp, out);
    count_for_draw_0(*this, unit_);
  }
  void shade_vertices(const VertexWarp& warp) override { unit_.shade_vertices(warp); }
  const SmTime& time() const override { return unit_.time(); }
  SplatShader unit_;
};
/// Shades a draw's quads as if they were of the first.
struct SmOfDraw0 : SplatShader {
  using SplatShader::SplatShader;
  void shade(const Warp& warp, ShadedWarp& out) override {
    SplatShader::shade(warp, out);
    out.draw.fill(0);
  }
};
struct CropForDraw0 : CropBehaviour {
  struct Parameters : CropParameters {};
  CropForDraw0(const Parameters& parameters, const RenderContext& context) : rop(parameters, context) {}
  void attach(ColorSurface& surface) override {
    CropBehaviour::attach(surface);
    rop.attach(surface);
  }
  void pass(Mark mark) override { rop.pass(mark); }
  Outcome blend(DrawIndex draw, std::size_t place, LaneMask live, const QuadColor& color) override {
    const Outcome outcome = rop.blend(draw, place, live, color);
    count_for_draw_0(*this, rop);
    return outcome;
  }
  const CropTime& time() const override { return rop.time(); }
  ColorRop<ColorFormat::rgba16f, BlendRounding::rne> rop;
};
/// Adds to a draw's counter as to one that knows no draws.
struct VpoForNoDraw : VpoForDraw0 {
  using VpoForDraw0::VpoForDraw0;
  unsigned assemble(DrawIndex draw, std::uint32_t splat, std::array<Primitive, 2>& out) override {
    const unsigned count = unit_.assemble(draw, splat, out);
    static_cast<Counter&>(primitives) += count;
    return count;
  }
};

std::vector<Case>& cases_of_frames() {
  static std::vector<Case> all;
  return all;
}
template <class Unit, class SlotBehaviour>
struct AddOfFrames {
  AddOfFrames(const char* slot, const char* name, const char* expected) {
    const Registrar<Unit, SlotBehaviour> registrar(slot, name, "breaks a rule in a frame of several draws");
    cases_of_frames().push_back({slot, name, expected});
  }
};
const AddOfFrames<DrawOfOtherMarks<WithoutTheFirst>, DrawBehaviour> draw_first("draw", "no-first",
                                                                               "next: no mark of command 1");
const AddOfFrames<DrawOfOtherMarks<WithoutTheLast>, DrawBehaviour> draw_last("draw", "no-last",
                                                                             "next: no mark of command 4");
const AddOfFrames<DrawOfOtherMarks<TheFirstAgain>, DrawBehaviour> draw_twice(
    "draw", "first-again", "next: a mark of command 1, of which 3 of 5 have passed");
const AddOfFrames<DrawOfOtherMarks<BeyondTheFrame>, DrawBehaviour> draw_beyond("draw", "mark-beyond",
                                                                               "next: a mark of command 70");
const AddOfFrames<DrawOfEarlyMarks, DrawBehaviour> draw_early(
    "draw", "early-mark", "next: a warp of draw 0, command 0, behind the mark of command 1");
const AddOfFrames<VpoForDraw0, VpoBehaviour> vpo_first("vpo", "for-draw-0", "primitives counts");
const AddOfFrames<VpoForNoDraw, VpoBehaviour> vpo_none("vpo", "for-no-draw", "primitives counts");
const AddOfFrames<RasterForDraw0, RasterBehaviour> raster_first("raster", "for-draw-0", "quads_rasterized counts");
const AddOfFrames<ZropForDraw0, ZropBehaviour> zrop_first("zrop", "for-draw-0", "quads_tested counts");
const AddOfFrames<SmForDraw0, SmBehaviour> sm_first("sm", "for-draw-0", "quads_shaded counts");
const AddOfFrames<SmOfDraw0, SmBehaviour> sm_of_first("sm", "of-draw-0", "for draw 0, which has 100 from 0 on");
const AddOfFrames<CropForDraw0, CropBehaviour> crop_first("crop", "for-draw-0", "quads_dropped_late counts");

TEST(CheckedUnits, AMarkOrACountOfTheWrongDrawIsAFaultThatNamesTheUnitAtEveryFidelity) {
  const auto draw = std::make_shared<Draw>(random_draw(100, 60, 200, 1));
  for (const Case& broken : cases_of_frames()) {
    for (const Fidelity fidelity : fidelities()) {
      SCOPED_TRACE(broken.slot + "=" + broken.name + " at " + name_of(fidelity));
      DrawState state = draw_state_of(request_of("het+qm"));
      Frame frame(100, 60);
      frame.draw(draw, state, "first", 0, 100);    // 0
      frame.clear({true, true});                   // 1
      frame.draw(draw, state, "second", 100, 50);  // 2
      state.pruning_threshold = 0.1F;
      frame.draw(draw, state, "third", 150);  // 3
      frame.clear({false, true});             // 4
      const std::string fault = fault_of(broken, fidelity, frame);
      EXPECT_EQ(fault.rfind(broken.slot + "=" + broken.name + " at cycle ", 0), 0U) << fault;
      EXPECT_NE(fault.find(broken.expected), std::string::npos) << fault;
    }
  }
}

struct ZropThatLetsTheDeadPass : DepthStencilRop {
  using DepthStencilRop::DepthStencilRop;
  std::uint32_t test_late(ShadedWarp& warp) override {
    const std::uint32_t changed = DepthStencilRop::test_late(warp);
    warp.live[0] = all_lanes;
    return changed;
  }
};
struct ZropThatTurnsQuadsAround : DepthStencilRop {
  using DepthStencilRop::DepthStencilRop;
  std::uint32_t test_late(ShadedWarp& warp) override {
    std::swap(warp.position[0], warp.position[warp.count - 1]);
    return 0;
  }
};
struct ZropThatCountsNothingLate : DepthStencilRop {
  using DepthStencilRop::DepthStencilRop;
  std::uint32_t test_late(ShadedWarp& warp) override {
    warp.count = 0;
    return 0;
  }
};
/// Pairs what it should not.
struct QruThatAlwaysPairs : PairingQru {
  QruThatAlwaysPairs(const Parameters& parameters, const RenderContext& context)
      : PairingQru(parameters, untested(context)) {}
  static const RenderContext& untested(const RenderContext& context) {
    static std::deque<RenderContext> kept;
    kept.push_back(context);
    auto frame = std::make_shared<Frame>(*context.frame);
    frame->change_states([](DrawState& state) { state.depth.test = false; });
    kept.back().frame = std::move(frame);
    return kept.back();
  }
};
std::vector<Case>& cases_of_late_tests() {
  static std::vector<Case> all;
  return all;
}
template <class Unit, class SlotBehaviour>
struct AddLate {
  AddLate(const char* slot, const char* name, const char* expected) {
    const Registrar<Unit, SlotBehaviour> registrar(slot, name, "breaks a rule");
    cases_of_late_tests().push_back({slot, name, expected});
  }
};
const AddLate<ZropThatLetsTheDeadPass, ZropBehaviour> zrop_dead("zrop", "revives", "not among these in this order");
const AddLate<ZropThatTurnsQuadsAround, ZropBehaviour> zrop_order("zrop", "turns", "not among these in this order");
const AddLate<ZropThatCountsNothingLate, ZropBehaviour> zrop_late("zrop", "no-late-counts",
                                                                  "quads_tested_late counts 0");
const AddLate<QruThatAlwaysPairs, QruBehaviour> qru_late("qru", "always-pairs", "a draw that is tested late");

TEST(CheckedUnits, ABrokenRuleOfLateTestsIsAFaultThatNamesTheUnitAtEveryFidelity) {
  const auto draw = std::make_shared<Draw>(random_draw(100, 60, 200, 1));
  for (const Case& broken : cases_of_late_tests()) {
    for (const Fidelity fidelity : fidelities()) {
      SCOPED_TRACE(broken.slot + "=" + broken.name + " at " + name_of(fidelity));
      DrawState state = draw_state_of(request_of("het+qm"));
      state.depth = {true, Compare::less, true};
      Frame frame(100, 60);
      frame.draw(draw, state);
      const std::string fault = fault_of(broken, fidelity, frame);
      EXPECT_EQ(fault.rfind(broken.slot + "=" + broken.name + " at cycle ", 0), 0U) << fault;
      EXPECT_NE(fault.find(broken.expected), std::string::npos) << fault;
    }
  }
}

/// The shipped units, not trusted.
const bool registered = [] {
  for (const Slot& slot : Registry::instance().slots()) {
    Implementation copy = default_implementation(slot, variant_named("het+qm"));
    copy.name = "checked";
    copy.trust = Trust::checked;
    Registry::instance().add(std::move(copy));
  }
  return true;
}();

/// In all slots whose units are checked: memories are not, and a platform need not have one.
void choose_checked(RunRequest& request) {
  for (const Slot& slot : Registry::instance().slots()) {
    if (slot.check != nullptr) request.units.push_back({slot.name, "checked"});
  }
}

/// The shipped RASTER and TGC, as somebody else's that count no more than they have to.
class SilentRaster : public RasterBehaviour {
 public:
  using Parameters = TileRasterizer::Parameters;
  SilentRaster(const Parameters& parameters, const RenderContext& context) : inner_(parameters, context) {}
  void begin(const Primitive& primitive, const PixelRect& clip) override {
    draw_ = primitive.draw;
    inner_.begin(primitive, clip);
  }
  bool next(QuadBeat& out, unsigned& coarse_tests, bool& new_screen_tile) override {
    const bool more = inner_.next(out, coarse_tests, new_screen_tile);
    for (unsigned i = 0; more && i < out.count; ++i) {
      quads_rasterized.add(draw_, 1);
      fragments_rasterized.add(draw_, popcount(out.quads[i].coverage));
    }
    return more;
  }
  const RasterTime& time() const override { return inner_.time(); }

 private:
  TileRasterizer inner_;
  DrawIndex draw_ = 0;
};
class SilentTgc : public TgcBehaviour {
 public:
  using Parameters = TileGridCoalescing::Parameters;
  SilentTgc(const Parameters& parameters, const RenderContext& context) : inner_(parameters, context) {}
  void begin(const Primitive& primitive) override { inner_.begin(primitive); }
  bool entering() const override { return inner_.entering(); }
  bool step(Flush& out) override { return counted(inner_.step(out)); }
  bool drain(Flush& out) override { return counted(inner_.drain(out)); }
  Throughput timing() const override { return inner_.timing(); }
  std::uint32_t largest_flush() const override { return inner_.largest_flush(); }
  std::uint64_t storage_bytes() const override { return inner_.storage_bytes(); }

 private:
  bool counted(bool is_flushed) {
    flushes += is_flushed ? 1 : 0;
    return is_flushed;
  }
  TileGridCoalescing inner_;
};

TEST(CheckedUnits, WhatAUnitDoesNotCountIsCountedForIt) {
  const Registrar<SilentRaster, RasterBehaviour> raster("raster", "silent", "counts no more than it has to");
  const Registrar<SilentTgc, TgcBehaviour> tgc("tgc", "silent", "counts no more than it has to");
  const Draw draw = random_draw(100, 60, 200, 2);
  for (const Fidelity fidelity : fidelities()) {
    RunRequest request = request_of("het+qm", fidelity);
    const RunResult shipped = run(request, draw);
    request.units = {{"raster", "silent"}, {"tgc", "silent"}};
    const RunResult silent = run(request, draw);
    EXPECT_EQ(silent.result_hash, shipped.result_hash);
    for (const char* name : {"tgc.entries", "raster.setups", "raster.raster_tiles_tested", "raster.raster_tiles_kept",
                             "raster.screen_tile_pairs"}) {
      EXPECT_GT(statistic(shipped, name), 0U) << name;
      EXPECT_EQ(statistic(silent, name), statistic(shipped, name)) << name << " at " << name_of(fidelity);
    }
  }
}

TEST(CheckedUnits, ChecksChangeNothing) {
  ASSERT_TRUE(registered);
  const Draw draw = random_draw(100, 60, 200, 2);
  for (const char* platform : {"agx-orin-ideal-memory", "desktop"}) {
    for (const char* variant : {"baseline", "het+qm"}) {
      for (const Fidelity fidelity : fidelities()) {
        for (const Termination termination : {Termination::paper, Termination::strict}) {
          RunRequest request = request_of(variant, fidelity, [&](RunRequest& r) {
            r.platform = &platform_named(platform);
            r.termination = termination;
          });
          const RunResult trusted = run(request, draw);
          choose_checked(request);
          const RunResult checked = run(request, draw);
          EXPECT_EQ(checked.result_hash, trusted.result_hash) << platform << variant << name_of(fidelity);
          EXPECT_EQ(checked.statistics.size(), trusted.statistics.size());
        }
      }
    }
  }
}

TEST(CheckedUnits, ChecksChangeNothingInAFrame) {
  const auto draw = std::make_shared<Draw>(random_draw(100, 60, 300, 3));
  for (std::uint32_t i = 0; i < 300; ++i) draw->splats[i].depth = testing::uniform(4, i, 0, 1);
  for (const char* platform : {"agx-orin-ideal-memory", "desktop"}) {
    for (const Fidelity fidelity : fidelities()) {
      for (const Termination termination : {Termination::paper, Termination::strict}) {
        RunRequest request = request_of("het+qm", fidelity, [&](RunRequest& r) {
          r.platform = &platform_named(platform);
          r.termination = termination;
        });
        DrawState state = draw_state_of(request);
        Frame frame(100, 60);
        frame.draw(draw, state, "first", 0, 100);
        frame.draw(draw, state, "second", 100, 60);
        frame.clear({true, true});
        state.early_termination = false;
        state.depth = {true, Compare::less_equal, true};  // tested after shading
        frame.draw(draw, state, "third", 160, 60);
        state.depth.write = false;
        state.early_termination = true;
        state.pruning_threshold = 0.1F;
        frame.draw(draw, state, "fourth", 220);
        fresh_simulation();
        const RunResult trusted = simulate(request, frame);
        choose_checked(request);
        fresh_simulation();
        const RunResult checked = simulate(request, frame);
        EXPECT_EQ(checked.result_hash, trusted.result_hash) << platform << name_of(fidelity);
        EXPECT_GT(checked.counts.quads_late_failed, 0U);
        ASSERT_EQ(checked.draws.size(), 4U);
        for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(checked.draws[i].counts, trusted.draws[i].counts);
      }
    }
  }
}

}  // namespace
}  // namespace vrpipe
