#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace vrpipe {

/// A queue in a ring that grows.
template <class Entry>
class Ring {
 public:
  bool empty() const { return head_ == tail_; }
  std::size_t size() const { return tail_ - head_; }
  Entry& front() { return entries_[head_ & mask_]; }
  const Entry& front() const { return entries_[head_ & mask_]; }
  Entry& back() { return entries_[(tail_ - 1) & mask_]; }
  Entry& operator[](std::size_t index) { return entries_[(head_ + index) & mask_]; }
  const Entry& operator[](std::size_t index) const { return entries_[(head_ + index) & mask_]; }
  /// A place at the end, to be filled.
  Entry& push() {
    if (tail_ - head_ > mask_) grow();
    return entries_[tail_++ & mask_];
  }
  void push(const Entry& entry) { push() = entry; }
  /// Where entries stand in the order of a member of theirs: behind those that are equal.
  template <class Member>
  void push_in_order(const Entry& entry, Member key) {
    if (entry.*key < back().*key) {  // of an empty ring's old entry it does not matter
      insert_in_order(entry, key);
    } else {
      push(entry);
    }
  }
  void pop() { ++head_; }

 private:
  template <class Member>
  [[gnu::noinline]] void insert_in_order(const Entry& entry, Member key) {
    push();
    std::size_t place = size() - 1;
    for (; place > 0 && entry.*key < (*this)[place - 1].*key; --place) (*this)[place] = (*this)[place - 1];
    (*this)[place] = entry;
  }
  [[gnu::noinline]] void grow() {
    std::vector<Entry> larger(2 * entries_.size());
    const std::size_t count = size();
    for (std::size_t i = 0; i < count; ++i) larger[i] = std::move(entries_[(head_ + i) & mask_]);
    entries_ = std::move(larger);
    mask_ = entries_.size() - 1;
    head_ = 0;
    tail_ = count;
  }
  std::vector<Entry> entries_ = std::vector<Entry>(8);
  std::size_t mask_ = 7;
  std::size_t head_ = 0;
  std::size_t tail_ = 0;
};

}  // namespace vrpipe
