#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "beat_lines.h"

#include <vrpipe/kernel/link.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/cache_port.h>
#include <vrpipe/memory/line_visits.h>
#include <vrpipe/memory/sectors.h>
#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// What reading into the z-cache takes of the ROPs' port, at cycle; nothing where that is not connected.
class ReadFlits {
 public:
  /// Both outlive it.
  ReadFlits(StreamOut<PortReads>& out, const BeatLines& lines) : out_(out), lines_(lines) {}
  bool has_room() const { return out_.credits() > 0; }
  /// Sectors of a line of which others are held; only while there is room.
  void read(std::uint64_t address, std::uint32_t sectors, std::uint32_t held) {
    if (sectors == 0 || out_.is_stub()) return;
    if (const unsigned flits = lines_.flits_of(address, sectors, held); flits > 0) out_.push({flits});
  }

 private:
  StreamOut<PortReads>& out_;
  const BeatLines& lines_;
};

/// The z-cache at cycle where its tags run ahead of its data: what a test misses is read for it, and the line may go
/// meanwhile. Tags are looked at twice, as CROP's are: a first look asks for what is missed, at once; beats then wait, in
/// their order, for a second, where they stop for lines that come back, which are read again (LineVisits), and first looks with
/// them. A beat is here one primitive's, and halves of 8x8 blocks, 4x8 pixels, are what it asks for.
class ZLinesAhead {
 public:
  /// All outlive it; `cleared` may be null.
  ZLinesAhead(CachePort& port, ReadFlits& flits, const ZCache& timing, const BeatLines& lines, ClearedSectors* cleared)
      : port_(port),
        flits_(flits),
        lines_(lines),
        cleared_(cleared),
        sectors_of_a_line_(timing.organization.sectors_of_a_line()),
        sector_bytes_(timing.organization.sector_bytes),
        mshrs_(timing.mshrs),
        read_of_line_(timing.organization.lines()),
        uses_(lines.lines()) {}

  /// What a beat waits for.
  struct Waits {
    std::uint64_t reads = 0;   ///< the last of those that were asked for at first looks
    unsigned reads_again = 0;  ///< of its own
    std::uint32_t visit = 0;
    std::uint16_t begins = 0;  ///< lines that came into the cache for it, a bit each
  };

  /// Goes on with the first look at a line, the `at`th of a beat; false while it has to wait.
  template <class Moved>
  bool look_up(CachePort::LookUp& wanted, unsigned at, Waits& waits, Moved&& moved) {
    bool came = false;
    const bool done = look_up(wanted, left_, waits.reads, moved, came);
    if (came) waits.begins = static_cast<std::uint16_t>(waits.begins | 1U << at);
    return done;
  }
  /// The only look at a line for a late test; `left`: sectors yet to be read, between calls, and `reads` becomes the last
  /// read that it waits for.
  template <class Moved>
  bool look_up_late(CachePort::LookUp& wanted, std::uint32_t& left, std::uint64_t& reads, Moved&& moved) {
    bool came = false;
    return look_up(wanted, left, reads, moved, came);
  }

  /// Goes on with the second look of a beat, by number; false while it has to stop.
  template <class Moved>
  bool look_again(const QuadBeat& beat, std::uint64_t number, Waits& waits, Moved&& moved) {
    if (!again_begun_) lines_.find(beat.tile, beat.quads.data(), beat.count, needed_);
    if (!std::exchange(again_begun_, true)) at_ = 0;
    for (; at_ < needed_.count; ++at_) {
      if (!look_again(needed_.lines[at_], number, waits, moved)) return false;
    }
    again_begun_ = false;
    return true;
  }
  /// Whether the last second look was, so that no beat is looked up for the first time.
  bool is_stopped() const { return is_stopped_; }
  /// A beat that was looked up is tested.
  void used(const QuadBeat& beat, const Waits& waits) {
    BeatLines::Needed needed;
    lines_.find(beat.tile, beat.quads.data(), beat.count, needed);
    for (unsigned i = 0; i < needed.count; ++i) {
      uses_[lines_.index(needed.lines[i].address)].used(waits.visit, halves_of(needed.lines[i]));
    }
  }

  /// Takes reads that have come; `again(number)` is called for each that a second look of a beat has asked for.
  template <class Again>
  void take_reads(Again&& again) {
    std::uint32_t id = 0;
    while (port_.next_ahead(id)) {
      if ((id & again_tag) != 0) {
        const unsigned count = (id >> number_bits & 31U) + 1;
        filling_ -= count;
        again(id & number_mask);
      } else {
        filling_ -= sizes_[(id - static_cast<std::uint32_t>(done_ + 1)) & id_mask];
        came_.push_back(id);
      }
    }
    // The others in their order, as beats use them.
    for (auto found = came_.begin();
         (found = std::find(came_.begin(), came_.end(), static_cast<std::uint32_t>(done_ + 1) & id_mask)) !=
         came_.end();) {
      came_.erase(found);
      ++done_;
      sizes_.pop();
    }
  }
  /// Whether a read of a first look has come.
  bool has_come(std::uint64_t read) const { return done_ >= read; }
  /// Of the number of a beat, what `again` is given.
  static constexpr unsigned number_bits = 24;
  static constexpr std::uint32_t number_mask = (1U << number_bits) - 1;

 private:
  static constexpr std::uint32_t again_tag = 1U << 30U;
  static constexpr std::uint32_t id_mask = again_tag - 1;

  template <class Moved>
  bool look_up(CachePort::LookUp& wanted, std::uint32_t& left, std::uint64_t& reads, Moved&& moved, bool& came) {
    if (!port_.write_back(moved)) return false;
    if (left == 0) {
      SectoredCache& cache = port_.cache();
      const bool is_held = cache.find(wanted.address) != SectoredCache::no_line;
      if (!flits_.has_room() || (!is_held && !cache.can_allocate(wanted.address))) return false;
      LineAccess access;
      access.address = wanted.address;
      access.sectors = wanted.sectors;
      if (cleared_ != nullptr) access.known = cleared_->of_line(wanted.address);
      cache.look_up(access);
      if (cleared_ != nullptr) cleared_->count(access.missed & access.known);
      wanted.line = access.line;
      if (access.replaced) {
        read_of_line_[access.line] = 0;
        came = true;
        if (access.written_back != 0) port_.evict(access);
      }
      left = access.filled;
      flits_.read(wanted.address, left, cache.present(access.line) & ~left);
    }
    while (left != 0) {
      if (!may_read()) return false;
      ++asked_;
      const SectorRun run = take_run(left);
      read(wanted.address, run, static_cast<std::uint32_t>(asked_) & id_mask, moved);
      sizes_.push(run.count);
      read_of_line_[wanted.line] = asked_;
    }
    reads = std::max(reads, read_of_line_[wanted.line]);
    return true;
  }

  template <class Moved>
  bool look_again(const BeatLines::Needed::Line& line, std::uint64_t number, Waits& waits, Moved&& moved) {
    LineUses& uses = uses_[lines_.index(line.address)];
    const auto bit = static_cast<std::uint16_t>(1U << at_);
    if (left_again_ == 0) {
      const std::uint32_t halves = halves_of(line);
      if ((waits.begins & bit) != 0 && uses.begin(halves))
        waits.begins = static_cast<std::uint16_t>(waits.begins & ~bit);
      is_stopped_ = (waits.begins & bit) != 0 || !uses.may_go(waits.visit, halves, lines_.half_of_a_line());
      if (is_stopped_ || !flits_.has_room()) return false;
      bool is_first = false;
      const std::uint32_t lacking = uses.go(halves, halves, is_first);
      left_again_ = uses.comes_back() ? lines_.sectors_of(line.address, lacking) & line.sectors : 0;
      flits_.read(line.address, left_again_, 0);
    }
    while (left_again_ != 0) {
      if (!may_read()) return false;
      const std::uint32_t of = static_cast<std::uint32_t>(number) & number_mask;
      const SectorRun run = take_run(left_again_);
      read(line.address, run, again_tag | (run.count - 1) << number_bits | of, moved);
      ++waits.reads_again;
    }
    return true;
  }

  /// What a visit asks for.
  std::uint32_t halves_of(const BeatLines::Needed::Line& line) const {
    return lines_.halves_with(line.address, line.sectors);
  }
  bool may_read() const { return filling_ < mshrs_ && port_.memory_is_available(); }
  /// Of some sectors, those that one access reads: as many as there are registers free.
  SectorRun take_run(std::uint32_t& sectors) const {
    return take_sector_run(sectors, std::min(sectors_of_a_line_, mshrs_ - filling_));
  }
  template <class Moved>
  void read(std::uint64_t line, SectorRun run, std::uint32_t id, Moved&& moved) {
    port_.read_ahead(line + std::uint64_t{run.first} * sector_bytes_, run.count, id);
    filling_ += run.count;
    moved(run.count);
  }

  CachePort& port_;
  ReadFlits& flits_;
  const BeatLines& lines_;
  ClearedSectors* const cleared_;
  const unsigned sectors_of_a_line_;
  const std::uint64_t sector_bytes_;
  const unsigned mshrs_;
  unsigned filling_ = 0;  ///< sectors
  // Reads of first looks are numbered from 1.
  std::uint64_t asked_ = 0;
  std::uint64_t done_ = 0;
  Ring<unsigned> sizes_;                     ///< of those from `done_` on, sectors
  std::vector<std::uint32_t> came_;          ///< before others that were asked for earlier
  std::vector<std::uint64_t> read_of_line_;  ///< by line of the cache: the last for it
  std::uint32_t left_ = 0;                   ///< sectors of the line at a first look, yet to be read
  // Of the beat at its second look:
  bool again_begun_ = false;
  BeatLines::Needed needed_;
  unsigned at_ = 0;  ///< of the lines needed
  std::uint32_t left_again_ = 0;
  bool is_stopped_ = false;
  std::vector<LineUses> uses_;  ///< by line of the surface: of beats that were looked up twice
};

}  // namespace vrpipe
