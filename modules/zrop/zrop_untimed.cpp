#include <algorithm>

#include <vrpipe/model/occupancy.h>
#include <vrpipe/model/untimed.h>

namespace vrpipe {

namespace {

/// ZROP without time: a bin's test sees what the bins before it have terminated. Ports as in zrop_timed.cpp.
class UntimedZrop : public UntimedUnit {
 public:
  UntimedZrop(const std::string& name, std::unique_ptr<ZropBehaviour> behaviour)
      : UntimedUnit(name),
        out_(*this, "out_quads"),
        in_(input<BinItem>("in_quads", [this](const BinItem& item) { test(item); })),
        in_terminations_(input<TerminationBeat>("in_terminations",
                                                [this](const TerminationBeat& beat) {
                                                  for (unsigned i = 0; i < beat.count; ++i)
                                                    behaviour_->update(beat.signals[i]);
                                                })),
        behaviour_(std::move(behaviour)) {}

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  void test(const BinItem& incoming) {
    if (incoming.mark != Mark::none) {
      behaviour_->pass(incoming.mark);
      return out_.send(incoming);
    }
    BinItem item = incoming;
    std::vector<Quad>& quads = item.storage->flush.quads;
    did(ZropWork::tests, item.quads);
    item.quads = 0;
    beat_.tile = item.tile;
    for (unsigned from = 0; from < incoming.quads;) {
      beat_.count = static_cast<std::uint8_t>(std::min(incoming.quads - from, QuadBeat::capacity));
      std::copy_n(quads.begin() + from, beat_.count, beat_.quads.begin());
      from += beat_.count;
      beat_.last_of_bin = from == incoming.quads;
      behaviour_->test(beat_);
      std::copy_n(beat_.quads.begin(), beat_.count, quads.begin() + item.quads);
      item.quads += beat_.count;
    }
    out_.send(item);
  }

  UntimedOut<BinItem> out_;
  std::unique_ptr<UntimedIn<BinItem>> in_;
  std::unique_ptr<UntimedIn<TerminationBeat>> in_terminations_;
  std::unique_ptr<ZropBehaviour> behaviour_;
  QuadBeat beat_;
};

[[maybe_unused]] const bool registered = [] {
  register_untimed_unit_maker("zrop", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                         const RenderContext&, unsigned) {
    return std::make_unique<UntimedZrop>(name, behaviour_as<ZropBehaviour>(std::move(behaviour)));
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
