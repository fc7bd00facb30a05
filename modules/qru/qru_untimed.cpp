#include "qru/warp_numbering.h"

#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/slots/qru.h>
#include <vrpipe/pipeline/slots/tc.h>

namespace vrpipe {

namespace {

/// QRU without time. Ports as in qru_timed.cpp.
class UntimedQru : public UntimedUnit {
 public:
  UntimedQru(const std::string& name, std::unique_ptr<QruBehaviour> behaviour, const RenderContext& context)
      : UntimedUnit(name, QruWork::kinds(behaviour->timing())),
        out_(*this, "out_warps"),
        in_(input<BinItem>("in_quads", [this](const BinItem& item) { examine(item); })),
        behaviour_(std::move(behaviour)),
        numbering_(context, *behaviour_) {}

  Behaviour& behaviour() override { return *behaviour_; }
  void prefetch_for(UntimedUnit& blender) override { blender_ = &blender; }

 private:
  void examine(const BinItem& item) {
    if (item.mark != Mark::none) {
      Warp mark;
      mark.mark = item.mark;
      numbering_.number_mark(mark);
      return out_.send(mark);
    }
    const Quad* const quads = item.storage->flush.quads.data();
    for (unsigned from = 0; from < item.quads;) {
      bool launched = false;
      from += behaviour_->examine(item.tile, quads + from, item.quads - from, warp_, launched);
      if (launched) launch();
    }
    while (item.last_part && behaviour_->finish_bin(warp_)) launch();
  }

  void launch() {
    did(QruWork::launches, 1);
    if (blender_ != nullptr) blender_->prefetch(warp_);
    numbering_.number(warp_);
    out_.send(warp_);
  }

  UntimedOut<Warp> out_;
  std::unique_ptr<UntimedIn<BinItem>> in_;
  std::unique_ptr<QruBehaviour> behaviour_;
  UntimedUnit* blender_ = nullptr;
  WarpNumbering numbering_;
  Warp warp_;
};

[[maybe_unused]] const bool qru_untimed_registered = [] {
  register_untimed_unit_maker("qru", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                        const RenderContext& context, unsigned) {
    return std::make_unique<UntimedQru>(name, behaviour_as<QruBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
