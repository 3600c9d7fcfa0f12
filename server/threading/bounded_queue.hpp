#pragma once

#include <cstddef>
#include <deque>
#include <mutex>
#include <utility>
#include <vector>

#include "core/assert.hpp"

namespace hairnet::server {

// A queue between threads, bounded by the sum of its items' weights. A full queue refuses an item and never blocks. Any
// thread may call any function.
template <class T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t weight_max) : weight_max_(weight_max) {}

  // Returns false, without changing `item`, when it does not fit. An item heavier than the bound fits an empty queue.
  bool try_put(T& item, std::size_t weight = 1) {
    const std::lock_guard lock(mutex_);
    if (!has_room(weight)) return false;
    weight_ += weight;
    items_.emplace_back(std::move(item), weight);
    return true;
  }
  // Whether try_put() takes an item of that weight. An answer of true holds until another item is put.
  [[nodiscard]] bool fits(std::size_t weight) const {
    const std::lock_guard lock(mutex_);
    return has_room(weight);
  }
  // For items that must not be lost, and whose number has another bound: the number of sessions, characters or grooms.
  // Weighs nothing.
  void put(T item) {
    const std::lock_guard lock(mutex_);
    items_.emplace_back(std::move(item), 0);
  }
  // Takes the oldest item. Returns false, and leaves `out`, when there is none.
  bool take(T& out) {
    const std::lock_guard lock(mutex_);
    if (items_.empty()) return false;
    HAIRNET_ASSERT(weight_ >= items_.front().weight);
    out = std::move(items_.front().item);
    weight_ -= items_.front().weight;
    items_.pop_front();
    HAIRNET_ASSERT(!items_.empty() || weight_ == 0);
    return true;
  }
  // Takes all items in order; overwrites `out`.
  void take_all(std::vector<T>& out) {
    out.clear();
    const std::lock_guard lock(mutex_);
    for (Item& i : items_) out.push_back(std::move(i.item));
    items_.clear();
    weight_ = 0;
  }
  // The weight of the items that wait; put() adds none.
  [[nodiscard]] std::size_t weight() const {
    const std::lock_guard lock(mutex_);
    return weight_;
  }
  [[nodiscard]] bool empty() const {
    const std::lock_guard lock(mutex_);
    return items_.empty();
  }

 private:
  // The first condition lets through an item that is heavier than the whole bound; without it, such an item would be
  // refused forever.
  [[nodiscard]] bool has_room(std::size_t weight) const { return items_.empty() || weight_ + weight <= weight_max_; }

  struct Item {
    Item(T&& i, std::size_t w) : item(std::move(i)), weight(w) {}
    T item;
    std::size_t weight;
  };
  mutable std::mutex mutex_;
  std::deque<Item> items_;
  std::size_t weight_ = 0;
  const std::size_t weight_max_;
};

}  // namespace hairnet::server
