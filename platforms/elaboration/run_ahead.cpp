#include "elaboration/run_ahead.h"

#include <algorithm>
#include <deque>
#include <map>

#include "elaboration/elaborate.h"

#include <vrpipe/pipeline/slots/crop.h>
#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

/// What became of the warps that were shaded here and not yet blended by the timing models, in launch order.
class RunAhead::Record {
 public:
  /// A warp has been shaded; what CROP does with its quads follows.
  void shaded(const ShadedWarp& warp) {
    if (warps_.empty()) first_ = warp.sequence;
    Entry& entry = warps_.emplace_back();
    entry.tile = warp.tile;
    entry.tile_sequence = warp.tile_sequence;
    entry.count = warp.count;
    entry.position = warp.position;
    entry.live = warp.live;
    entry.first_primitive = warp.first_primitive;
    entry.last_primitive = warp.last_primitive;
    entry.draw = warp.draw;
  }
  /// It has been tested late, which left these samples of its quads.
  void tested_late(std::uint32_t sequence, const std::array<LaneMask, quads_per_warp>& left, std::uint32_t changed) {
    Entry& entry = find(sequence);
    entry.left_by_test = left;
    entry.changed_by_test = changed;
  }
  void blended(const ShadedWarp& warp, unsigned from, unsigned to, const CropBehaviour::Outcomes& outcomes) {
    Entry& entry = find(warp.sequence);
    std::copy(outcomes.begin() + from, outcomes.begin() + to, entry.outcomes.begin() + from);
  }
  /// Shades as before, but for the colours, which nobody looks at any more.
  void repeat(const Warp& warp, ShadedWarp& out) {
    Entry& entry = find(warp.sequence);
    out.tile = entry.tile;
    out.sequence = warp.sequence;
    out.tile_sequence = entry.tile_sequence;
    out.count = entry.count;
    out.mark = Mark::none;
    out.position = entry.position;
    out.live = entry.live;
    out.first_primitive = entry.first_primitive;
    out.last_primitive = entry.last_primitive;
    out.draw = entry.draw;
    entry.left = entry.count;
    forget();
  }
  std::uint32_t repeat_late_test(ShadedWarp& warp) {
    Entry& entry = find(warp.sequence);
    const std::uint32_t changed = entry.changed_by_test;
    warp.keep(entry.left_by_test);
    entry.left = warp.count;
    forget();
    return changed;
  }
  void repeat(const ShadedWarp& warp, unsigned from, unsigned to, CropBehaviour::Outcomes& outcomes) {
    Entry& entry = find(warp.sequence);
    std::copy(entry.outcomes.begin() + from, entry.outcomes.begin() + to, outcomes.begin() + from);
    entry.left -= to - from;
    forget();
  }

 private:
  static constexpr unsigned not_shaded = ~0U;
  struct Entry {
    TileId tile;
    std::uint32_t tile_sequence;
    std::uint8_t count;
    std::array<std::uint8_t, quads_per_warp> position;
    std::array<LaneMask, quads_per_warp> live;
    std::array<std::uint32_t, quads_per_warp> first_primitive;
    std::array<std::uint32_t, quads_per_warp> last_primitive;
    std::array<DrawIndex, quads_per_warp> draw;
    CropBehaviour::Outcomes outcomes;
    std::array<LaneMask, quads_per_warp> left_by_test;  ///< where it was tested late
    std::uint32_t changed_by_test;
    unsigned left = not_shaded;  ///< quads that the timing model has not blended yet
  };
  Entry& find(std::uint32_t sequence) {
    if (sequence - first_ < warps_.size()) return warps_[sequence - first_];
    throw SimulationFault("strict termination", 0, "a warp was launched that did not run ahead");
  }
  void forget() {
    for (; !warps_.empty() && warps_.front().left == 0; ++first_) warps_.pop_front();
  }

  std::deque<Entry> warps_;
  std::uint32_t first_ = 0;
};

/// The units proper, behind what records their results.
class RunAhead::RecordingSm final : public SmBehaviour {
 public:
  RecordingSm(std::unique_ptr<SmBehaviour> sm, Record& record) : sm_(std::move(sm)), record_(record) {}
  const Behaviour& unit() const override { return sm_->unit(); }
  void attach(const ColorSurface& surface) override { sm_->attach(surface); }
  void shade(const Warp& warp, ShadedWarp& out) override {
    sm_->shade(warp, out);
    record_.shaded(out);
  }
  void shade_vertices(const VertexWarp& warp) override { sm_->shade_vertices(warp); }
  const SmTime& time() const override { return sm_->time(); }

 private:
  std::unique_ptr<SmBehaviour> sm_;
  Record& record_;
};

class RunAhead::RecordingCrop final : public CropBehaviour {
 public:
  RecordingCrop(std::unique_ptr<CropBehaviour> crop, Record& record) : crop_(std::move(crop)), record_(record) {}
  const Behaviour& unit() const override { return crop_->unit(); }
  void attach(ColorSurface& surface) override {
    CropBehaviour::attach(surface);
    crop_->attach(surface);
  }
  void pass(Mark mark) override { crop_->pass(mark); }
  Outcome blend(DrawIndex draw, std::size_t place, LaneMask live, const QuadColor& color) override {
    return crop_->blend(draw, place, live, color);
  }
  void blend_quads(const ShadedWarp& warp, unsigned from, unsigned to, CropBehaviour::Outcomes& outcomes) override {
    crop_->blend_quads(warp, from, to, outcomes);
    record_.blended(warp, from, to, outcomes);
  }
  const CropTime& time() const override { return crop_->time(); }

 private:
  std::unique_ptr<CropBehaviour> crop_;
  Record& record_;
};

class RunAhead::RepeatingSm final : public SmBehaviour {
 public:
  RepeatingSm(SmBehaviour& sm, Record& record) : sm_(sm), record_(record) {}
  const Behaviour& unit() const override { return sm_.unit(); }
  void shade(const Warp& warp, ShadedWarp& out) override { record_.repeat(warp, out); }
  void shade_vertices(const VertexWarp& warp) override { sm_.shade_vertices(warp); }
  const SmTime& time() const override { return sm_.time(); }

 private:
  SmBehaviour& sm_;
  Record& record_;
};

/// What the colour cache holds depends on the order in which the timing model looks it up.
class RunAhead::RepeatingCrop final : public CropBehaviour {
 public:
  RepeatingCrop(CropBehaviour& crop, Record& record) : crop_(crop), record_(record) {}
  const Behaviour& unit() const override { return crop_.unit(); }
  void pass(Mark) override {}  ///< what is cleared was cleared ahead of time
  Outcome blend(DrawIndex, std::size_t, LaneMask, const QuadColor&) override {
    throw SimulationFault("crop", 0, "a quad was blended without its warp");
  }
  void blend_quads(const ShadedWarp& warp, unsigned from, unsigned to, CropBehaviour::Outcomes& outcomes) override {
    record_.repeat(warp, from, to, outcomes);
  }
  void look_up(const ShadedWarp& warp, unsigned from, unsigned to, CacheLookUp& out) override {
    crop_.look_up(warp, from, to, out);
  }
  SectoredCache* cache() override { return crop_.cache(); }
  const CropTime& time() const override { return crop_.time(); }

 private:
  CropBehaviour& crop_;
  Record& record_;
};

/// Stands for ZROP behind PROP.
class RunAhead::LateTests final : public UntimedTarget<ShadedWarpItem> {
 public:
  LateTests(Record& record, UntimedTarget<ShadedWarpItem>& back) : record_(record), back_(back) {}
  void take(const ShadedWarpItem& item) override {
    ShadedWarp& warp = item.warp->editable();
    const ShadedWarp before = warp;
    const std::uint32_t changed = zrop->test_late(warp);
    // Quads that are left are in order, and none is there twice.
    std::array<LaneMask, quads_per_warp> left{};
    for (unsigned i = 0, at = 0; i < before.count && at < warp.count; ++i) {
      const bool stays =
          warp.position[at] == before.position[i] && warp.first_primitive[at] == before.first_primitive[i];
      if (stays) left[i] = warp.live[at++];
    }
    record_.tested_late(warp.sequence, left, changed);
    back_.take(item);
  }
  ZropBehaviour* zrop = nullptr;

 private:
  Record& record_;
  UntimedTarget<ShadedWarpItem>& back_;
};

class RunAhead::RepeatingZrop final : public ZropBehaviour {
 public:
  RepeatingZrop(std::unique_ptr<ZropBehaviour> zrop, Record& record) : zrop_(std::move(zrop)), record_(record) {}
  const Behaviour& unit() const override { return zrop_->unit(); }
  void attach(DepthStencilSurface& surface) override {
    ZropBehaviour::attach(surface);
    zrop_->attach(surface);
  }
  std::uint32_t test(QuadBeat& beat) override { return zrop_->test(beat); }
  std::uint32_t test_late(ShadedWarp& warp) override { return record_.repeat_late_test(warp); }
  void update(const TerminationSignal& signal) override { zrop_->update(signal); }
  void pass(Mark mark) override { zrop_->pass(mark); }
  void follow(FunctionalRunAhead& run_ahead) override { zrop_->follow(run_ahead); }
  const ZropTime& time() const override { return zrop_->time(); }

 private:
  std::unique_ptr<ZropBehaviour> zrop_;
  Record& record_;
};

class RunAhead::Signals final : public UntimedTarget<TerminationBeat> {
 public:
  void take(const TerminationBeat& beat) override {
    terminated->insert(terminated->end(), beat.signals.begin(), beat.signals.begin() + beat.count);
  }
  std::vector<TerminationSignal>* terminated = nullptr;
};

namespace {

/// The units behind a port, down to CROP.
std::vector<const Instance*> units_behind(const Netlist& netlist, const std::string& port) {
  // Of the units that have several outputs, the one that shaded quads take.
  static const std::map<std::string, std::string> way{{"sm", "out_shaded"}, {"prop", "out_color"}, {"crop", ""}};
  std::vector<const Instance*> found;
  std::vector<std::string> ports{port};
  while (!ports.empty()) {
    const Link* const link = netlist.link_from(ports.back());
    ports.pop_back();
    if (link == nullptr) continue;
    const Instance* const next = netlist.find(split_port(link->to).first);
    if (std::find(found.begin(), found.end(), next) != found.end()) continue;
    found.push_back(next);
    const auto only = way.find(next->slot);
    for (const Link& further : netlist.links()) {
      const auto [path, out] = split_port(further.from);
      if (path == next->path && (only == way.end() || only->second == out)) ports.push_back(further.from);
    }
  }
  return found;
}

}  // namespace

RunAhead::RunAhead(const Configuration& configuration, unsigned gpc, ColorSurface& surface)
    : record_(std::make_unique<Record>()), signals_(std::make_unique<Signals>()) {
  const Netlist& netlist = configuration.netlist();
  const auto missing = [&](const std::string& what) {
    throw UserError("cannot terminate early in strict order", "platform " + configuration.platform().name, what,
                    "wire a GPC as wire_gpc does, or take --termination paper");
  };
  const auto of_slot = [&](const std::string& slot) -> const Instance* {
    for (const Instance& instance : netlist.instances()) {
      if (instance.slot == slot && instance.gpc == gpc) return &instance;
    }
    return nullptr;
  };
  const Instance* const prop = of_slot("prop");
  const Link* const first = prop == nullptr ? nullptr : netlist.link_from(prop->path + ".out_survivors");
  if (first == nullptr) missing("no survivors leave PROP");

  std::map<std::string, UntimedUnit*> placed;
  UntimedUnit* qru = nullptr;
  UntimedUnit* crop = nullptr;
  UntimedUnit* order = nullptr;
  for (const Instance* instance : units_behind(netlist, first->from)) {
    std::unique_ptr<Behaviour> behaviour = configuration.make(*instance);
    if (instance->slot == "sm") {
      auto real = behaviour_as<SmBehaviour>(std::move(behaviour));
      real->attach(surface);
      sm_ = real.get();
      behaviour = std::make_unique<RecordingSm>(std::move(real), *record_);
    } else if (instance->slot == "crop") {
      auto real = behaviour_as<CropBehaviour>(std::move(behaviour));
      crop_ = real.get();
      auto recording = std::make_unique<RecordingCrop>(std::move(real), *record_);
      recording->attach(surface);
      behaviour = std::move(recording);
    }
    units_.push_back(untimed_unit_maker(instance->slot)(instance->path, std::move(behaviour),
                                                        configuration.context_of(gpc), netlist.gpcs()));
    placed[instance->path] = units_.back().get();
    if (instance->slot == "qru") qru = units_.back().get();
    if (instance->slot == "crop") crop = units_.back().get();
    if (instance->slot == "prop") order = units_.back().get();
  }
  if (sm_ == nullptr || crop_ == nullptr) missing("survivors do not reach an SM array and CROP");

  connect_units(netlist, nullptr, [&](const std::string& path) -> Component* {
    const auto found = placed.find(path);
    return found == placed.end() ? nullptr : found->second;
  });
  const auto [entry_path, entry_port] = split_port(first->to);
  entry_ = dynamic_cast<UntimedIn<BinItem>*>(&placed.at(entry_path)->in(entry_port));
  if (entry_ == nullptr) missing("survivors go to " + first->to + ", which takes something else");
  auto* const terminations = dynamic_cast<UntimedOut<TerminationBeat>*>(&crop->out("out_terminations"));
  if (terminations == nullptr) missing("CROP signals no terminations");
  terminations->attach(*signals_);
  if (configuration.frame().tests_late()) {
    auto* const late = order == nullptr ? nullptr : dynamic_cast<UntimedOut<ShadedWarpItem>*>(&order->out("out_late"));
    auto* const back = order == nullptr ? nullptr : dynamic_cast<UntimedIn<ShadedWarpItem>*>(&order->in("in_late"));
    if (late == nullptr || back == nullptr) missing("shaded warps do not go through PROP");
    late_tests_ = std::make_unique<LateTests>(*record_, *back);
    late->attach(*late_tests_);
  }
  for (const auto& unit : units_) {
    for (InPort* port : unit->in_ports) {
      if (!port->connected()) port->stub();
    }
    for (OutPort* port : unit->out_ports) {
      if (!port->connected()) port->stub();
    }
  }
  if (qru != nullptr) qru->prefetch_for(*crop);
}

RunAhead::~RunAhead() = default;

void RunAhead::pass(Mark mark) {
  BinItem item;
  item.mark = mark;
  entry_->take(item);
}

void RunAhead::tested(const QuadBeat& survivors, std::vector<TerminationSignal>& terminated) {
  signals_->terminated = &terminated;
  bin_.flush.quads.assign(survivors.quads.begin(), survivors.quads.begin() + survivors.count);
  BinItem item;
  item.storage = &bin_;
  item.tile = survivors.tile;
  item.quads = survivors.count;
  item.last_part = survivors.last_of_bin;
  entry_->take(item);
}

std::unique_ptr<Behaviour> RunAhead::make_repeating(const std::string& slot) {
  if (slot == "sm") return std::make_unique<RepeatingSm>(*sm_, *record_);
  return std::make_unique<RepeatingCrop>(*crop_, *record_);
}

std::unique_ptr<Behaviour> RunAhead::repeat_late_tests(std::unique_ptr<Behaviour> zrop) {
  auto real = behaviour_as<ZropBehaviour>(std::move(zrop));
  late_tests_->zrop = real.get();
  return std::make_unique<RepeatingZrop>(std::move(real), *record_);
}

Behaviour& RunAhead::unit(const std::string& slot) {
  if (slot == "sm") return *sm_;
  return *crop_;
}

}  // namespace vrpipe
