#include "server/tick/budget.hpp"

#include <algorithm>
#include <bit>
#include <numeric>
#include <tuple>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// Errors of hair relative to its motion, measured in tests/fidelity/README.md. A row is a level, in the order of
// LevelIndex: high, medium, low, ether, learnt, rigid. A column is a stride: 1, 2, 4. The error at every tick is the
// root of the sum of two squares: the error of the level's lattice against one of 14^3 nodes, and the error of its
// share of the springs against all springs (high, 10^3: 0.30 and 0.21; medium, 7^3: 0.44 and 0.21; low, 5^3: 0.64 and
// 0.20). The value of ether is a guess from how much faster its hair swings. A longer stride adds the square of its own
// error against every tick, as play-out shows it ("Strides" there has newer figures). The learnt level adds the square
// of its error against the high level to that of the high level ("Learnt hair" there).
constexpr std::array<std::array<double, 3>, kLevelCount> kError{{{0.37, 0.53, 0.68},
                                                                 {0.48, 0.58, 0.71},
                                                                 {0.67, 0.73, 0.81},
                                                                 {0.85, 0.90, 0.98},
                                                                 {0.54, 0.63, 0.75},
                                                                 {1.00, 1.02, 1.05}}};

constexpr double error_of(LevelIndex level, int stride) {
  HAIRNET_ASSERT(stride == 1 || stride == 2 || stride == 4);
  return kError[static_cast<std::size_t>(level)][static_cast<std::size_t>(std::countr_zero(unsigned(stride)))];
}

// One step of a ladder: the level, and how often it is stepped.
struct Rung {
  LevelIndex level;
  std::uint8_t stride;
};

// rebalance() lowers characters that cost more than their fair share of kEntitledMax of the time, for those that have
// less than their share of kEntitledMin. The time is the budget without rung 0 of all. The two values lie so far apart
// that noise in the costs does not cross both.
constexpr double kEntitledMin = 0.8, kEntitledMax = 1.0;

// The rungs of the ladder, by the finest level asked for. A rung that costs more than a finer one and has more error is
// left out: low at every tick (medium at every second tick is better), and high at every second tick (medium at every
// tick is better). So are learnt hair at every second tick, and medium above learnt hair: without them the mean error
// of 400 people grows by 0.2 points at most at any budget, and falls by up to 7, since each step is then worth its
// time. Without medium above low it would grow by 5.7 points, and without low and medium at every second tick by 6.1.
using enum LevelIndex;
constexpr std::array<Rung, 7> kToHigh{
    {{rigid, 4}, {ether, 4}, {low, 4}, {low, 2}, {medium, 2}, {medium, 1}, {high, 1}}};
constexpr std::span<const Rung> kToMedium = std::span(kToHigh).first(6);
constexpr std::array<Rung, 5> kToLow{{{rigid, 4}, {ether, 4}, {low, 4}, {low, 2}, {low, 1}}};
constexpr std::array<Rung, 4> kToEther{{{rigid, 4}, {ether, 4}, {ether, 2}, {ether, 1}}};
constexpr std::array<Rung, 4> kLearntToHigh{{{rigid, 4}, {learnt, 4}, {learnt, 1}, {high, 1}}};
constexpr std::array<Rung, 4> kLearntToMedium{{{rigid, 4}, {learnt, 4}, {learnt, 1}, {medium, 1}}};
constexpr std::span<const Rung> kToLearnt = std::span(kLearntToHigh).first(3);
constexpr std::array<Rung, 3> kToRigid{{{rigid, 4}, {rigid, 2}, {rigid, 1}}};
// The first kLevelCount ladders are indexed by the finest level that the owner asks for, in the order of LevelIndex.
// The others are the same where the learnt level may be used. Where it may not, a character whose owner asks for the
// learnt level gets the ladder to low.
constexpr std::size_t kLadderCount = 2 * kLevelCount;
constexpr std::array<std::span<const Rung>, kLadderCount> kLadders{kToHigh,   kToMedium, kToLow,        kToEther,
                                                                   kToLow,    kToRigid,  kLearntToHigh, kLearntToMedium,
                                                                   kToLearnt, kToLearnt, kToLearnt,     kToRigid};
// The rung that each character of a client gets before any of them gets more (BudgetItem::even): low or learnt at every
// fourth tick, or ether.
constexpr std::array<std::uint8_t, kLadderCount> kEven{2, 2, 2, 1, 2, 0, 1, 1, 1, 1, 1, 0};

// Each ladder goes from the largest error to the least, and fits an item.
static_assert([] {
  for (std::size_t l = 0; l < kLadderCount; ++l) {
    const std::span<const Rung> ladder = kLadders[l];
    if (ladder.empty() || ladder.size() > kRungCountMax || kEven[l] >= ladder.size()) return false;
    if (ladder.back().stride != 1) return false;
    for (std::size_t r = 1; r < ladder.size(); ++r) {
      if (error_of(ladder[r].level, ladder[r].stride) >= error_of(ladder[r - 1].level, ladder[r - 1].stride))
        return false;
    }
  }
  return true;
}());

// The error of each rung of each ladder. BudgetItem::error points to a row.
constexpr auto kRungErrors = [] {
  std::array<std::array<float, kRungCountMax>, kLadderCount> errors{};
  for (std::size_t l = 0; l < kLadderCount; ++l) {
    for (std::size_t r = 0; r < kLadders[l].size(); ++r)
      errors[l][r] = static_cast<float>(error_of(kLadders[l][r].level, kLadders[l][r].stride));
  }
  return errors;
}();

// The weight of a character's error: its size on screen, times a factor from 0.5 (the head is still) to 1 (the head
// moves fast). Touched hair weighs as if the head filled the screen, because the person who touches it looks at it
// closely.
double weight_of(const BudgetCharacter& c) {
  // Clients report sizes, so kMin and kMax bound them: no head weighs nothing, or more than a head that is twice as
  // high as the screen. A turning head moves the ends of its hair by about the turn times the hair's length, for which
  // 0.2 m stands. At 1 m/s the factor reaches 1.
  constexpr double kMin = 1e-3, kMax = 2, kTouched = 1, kStill = 0.5, kLively_m_per_s = 1, kHairLength_m = 0.2;
  const double least = c.is_touched ? kTouched : kMin;
  const double size = c.importance > least ? std::min<double>(c.importance, kMax) : least;
  const double motion =
      static_cast<double>(c.head_speed_m_per_s) + kHairLength_m * static_cast<double>(c.head_angular_speed_rad_per_s);
  // The condition is written so that NaN counts as still.
  const double lively = motion > 0 ? std::min(1.0, motion / kLively_m_per_s) : 0;
  const double weight = size * (kStill + (1 - kStill) * lively);
  HAIRNET_ASSERT(weight > 0);
  return weight;
}

// The index of the character's ladder in kLadders.
std::size_t ladder_of(const BudgetCharacter& c) {
  const LevelIndex finest = c.levels_ready ? c.requested_level : rigid;
  return static_cast<std::size_t>(finest) + (c.may_learn ? kLevelCount : 0);
}

// Whether the character is asleep and keeps its level: it costs nothing, and a change of level would wake it. It does
// not keep a level if it is suspended, if its owner asks for a coarser one, if it is rigid and its levels have become
// ready, or if the learnt level may not be used any more.
bool may_sleep_on(const BudgetCharacter& c) {
  if (!c.asleep || c.now.suspended || (c.now.level == learnt && !c.may_learn)) return false;
  const LevelIndex wanted = !c.levels_ready ? rigid : c.requested_level == learnt ? low : c.requested_level;
  return c.now.level >= wanted && (c.now.level != rigid || wanted == rigid);
}

// The finest rung of the ladder whose error is not smaller than that of the level and stride. After a change of its
// ladder, a character so goes on at about the same error.
std::uint8_t rung_of(const Lod& lod, std::size_t ladder_of) {
  const std::span<const Rung> ladder = kLadders[ladder_of];
  std::uint8_t rung = 0;
  if (lod.suspended) return rung;
  const double error = error_of(lod.level, lod.stride);
  while (rung + 1u < ladder.size() && error_of(ladder[rung + 1u].level, ladder[rung + 1u].stride) >= error) ++rung;
  return rung;
}

// Whole nanoseconds add up to the same sum in every order, so the result does not depend on the order of characters.
// The bound of 1000 s keeps sums of many characters from overflowing.
std::int64_t in_ns(double s) {
  return s > 0 ? static_cast<std::int64_t>(std::min(1e9 * s, 1e12)) : 0;
}

// The costs of ladders; the characters' own parts are added later.
class Prices {
 public:
  explicit Prices(const BudgetTerms& terms) : send_ns_(1e9 * std::max(0.0, terms.send_s)) {
    for (std::size_t l = 0; l < kLadderCount; ++l) {
      for (std::size_t r = 0; r < kLadders[l].size(); ++r) {
        const auto [level, stride] = kLadders[l][r];
        turn_ns_[l][r] =
            1e9 * (terms.cost->turn_s(level, stride) + std::max(0.0, terms.encode_s[static_cast<std::size_t>(level)]));
      }
    }
  }

  // Writes the costs of each rung of ladder `l` into the item.
  void put(std::size_t l, std::uint32_t observer_count, BudgetItem& item) const {
    std::int64_t before = 0;
    for (std::size_t r = 0; r < kLadders[l].size(); ++r) {
      const double turn_ns = turn_ns_[l][r] + observer_count * send_ns_;
      // fill_budget() needs costs that never fall with the rung; a measured cost may.
      before = std::max(before, static_cast<std::int64_t>(std::min(turn_ns, 1e12) / kLadders[l][r].stride));
      item.cost_ns[r] = before;
    }
  }

 private:
  // One frame takes this long to send to one observer.
  double send_ns_;
  // By ladder and rung: one turn, with the encoding of its frame, takes this long.
  std::array<std::array<double, kRungCountMax>, kLadderCount> turn_ns_{};
};

// One call of choose_levels(). s_.items has the characters that cost time, s_.target and s_.entitled a rung for each of
// them.
class Chooser {
 public:
  Chooser(const BudgetTerms& terms, std::span<const BudgetCharacter> characters, BudgetScratch& scratch,
          std::span<Lod> chosen)
      : terms_(terms), characters_(characters), s_(scratch), chosen_(chosen), budget_ns_(in_ns(terms.available_s)) {}

  // Over budget, all characters are lowered at once, since ticks already run late. Otherwise characters are raised as
  // far as the budget allows. Only where not all raises fit, characters above their fair share are lowered in favour of
  // those below theirs.
  BudgetReport run() {
    put_in_order();
    put_items();
    std::int64_t now_ns = 0;
    for (const BudgetItem& item : s_.items) {
      now_ns += item.cost_ns[item.now];
      wanted_ns_ += item.cost_ns[item.last];
    }
    s_.target.resize(s_.items.size());
    if (now_ns > budget_ns_) {
      fill_budget(share_of(kBudgetDown), s_.items, s_.fill, s_.target, Remainder::spend);
      // No character is raised while others are lowered, even if its target is higher: a raise could exceed the budget
      // again.
      for (std::size_t i = 0; i < s_.items.size(); ++i) set(i, std::min(s_.target[i], s_.items[i].now));
    } else {
      for (std::size_t i = 0; i < s_.items.size(); ++i) set(i, s_.items[i].now);
      sum_ns_ = now_ns;
      fill_budget(share_of(kBudgetUp), s_.items, s_.fill, s_.target, Remainder::spend);
      if (!raise_to_target()) rebalance();
    }
    return finish();
  }

 private:
  [[nodiscard]] std::int64_t share_of(double share) const {
    return static_cast<std::int64_t>(share * static_cast<double>(budget_ns_));
  }

  // Sorts the characters by subject, session and key, as fill_budget() needs them.
  void put_in_order() {
    // The order of the last call is usually still right.
    if (s_.order.size() != characters_.size()) {
      s_.order.resize(characters_.size());
      std::iota(s_.order.begin(), s_.order.end(), 0u);
    }
    const auto place = [this](std::uint32_t i) {
      const BudgetCharacter& c = characters_[i];
      return std::tuple(c.subject, c.session, c.key);
    };
    if (!std::ranges::is_sorted(s_.order, {}, place)) std::ranges::sort(s_.order, {}, place);
    // Keys are unique.
    HAIRNET_VALIDATE(std::ranges::adjacent_find(s_.order, {}, place) == s_.order.end());
  }

  // Puts only characters that have a cost; the levels of the others are chosen at once.
  void put_items() {
    const Prices prices(terms_);
    s_.items.clear();
    for (const std::uint32_t i : s_.order) {
      const BudgetCharacter& c = characters_[i];
      if (c.unseen_s >= kSuspendAfter_s) {
        chosen_[i] = c.now;
        chosen_[i].suspended = true;
        continue;
      }
      if (may_sleep_on(c)) {
        chosen_[i] = c.now;
        continue;
      }
      const std::size_t ladder = ladder_of(c);
      BudgetItem& item = s_.items.emplace_back();
      item.character = i;
      item.subject = c.subject;
      item.session = c.session;
      item.key = c.key;
      item.weight = weight_of(c);
      item.error = kRungErrors[ladder].data();
      item.now = rung_of(c.now, ladder);
      item.last = static_cast<std::uint8_t>(kLadders[ladder].size() - 1);
      item.even = kEven[ladder];
      prices.put(ladder, c.observer_count, item);
      // No observer sees the character now, so it is not raised: the detail would be wasted. It is not lowered either,
      // because the loss would be visible when an observer looks again.
      if (c.unseen_s > 0) item.last = item.now;
      HAIRNET_ASSERT(item.now <= item.last);
    }
  }

  // Raises characters to their rungs in `target` as far as kBudgetDown of the budget allows, the even rungs first.
  // Returns false when not all raises fit.
  bool raise_to_target() {
    s_.raises.clear();
    std::int64_t more_ns = 0;
    for (std::size_t i = 0; i < s_.items.size(); ++i) {
      if (s_.target[i] <= s_.items[i].now || !has_dwelt(s_.items[i])) continue;
      s_.raises.push_back(static_cast<std::uint32_t>(i));
      more_ns += cost_of_raise(i, s_.items[i].now, s_.target[i]);
    }
    const std::int64_t max_ns = share_of(kBudgetDown);
    const bool fits = sum_ns_ + more_ns <= max_ns;
    // Where not all raises fit, characters that weigh more come first; the key decides between equals, so that the
    // result is the same on every machine.
    if (!fits) {
      std::ranges::sort(s_.raises, {},
                        [this](std::uint32_t i) { return std::tuple(-s_.items[i].weight, s_.items[i].key); });
    }
    for (const bool is_even : {true, false}) {
      for (const std::uint32_t i : s_.raises) {
        const std::uint8_t from = chosen_rung(s_.items[i]);
        const std::uint8_t to = is_even ? std::min(s_.target[i], s_.items[i].even) : s_.target[i];
        if (to <= from || sum_ns_ + cost_of_raise(i, from, to) > max_ns) continue;
        sum_ns_ += cost_of_raise(i, from, to);
        set(i, to);
      }
    }
    return fits;
  }

  // Lowers characters that have more than their fair share of kEntitledMax of the time, and raises characters that have
  // less than their fair share of kEntitledMin of it. Time that the fair shares leave over is not spent.
  void rebalance() {
    s_.entitled.resize(s_.items.size());
    fill_budget(entitled_ns(kEntitledMin), s_.items, s_.fill, s_.entitled, Remainder::keep);
    const auto lacks = [this](std::size_t i) { return s_.entitled[i] > s_.items[i].now && has_dwelt(s_.items[i]); };
    bool does_anyone = false;
    for (std::size_t i = 0; i < s_.items.size() && !does_anyone; ++i) does_anyone = lacks(i);
    if (!does_anyone) return;
    fill_budget(entitled_ns(kEntitledMax), s_.items, s_.fill, s_.target, Remainder::keep);
    sum_ns_ = 0;
    for (std::size_t i = 0; i < s_.items.size(); ++i) {
      const BudgetItem& item = s_.items[i];
      // All characters are lowered before any is raised, so that their time is free for the others.
      const std::uint8_t rung = has_dwelt(item) ? std::min(s_.target[i], item.now) : item.now;
      set(i, rung);
      sum_ns_ += item.cost_ns[rung];
    }
    s_.target.swap(s_.entitled);
    raise_to_target();
  }

  // A share of the time that is left beyond rung 0 of all characters, and the time of these: where sending takes
  // most of the budget, no share of the whole would buy more than rung 0, and nobody would lack anything.
  [[nodiscard]] std::int64_t entitled_ns(double share) const {
    std::int64_t min_ns = 0;
    for (const BudgetItem& item : s_.items) min_ns += item.cost_ns[0];
    return min_ns + static_cast<std::int64_t>(share * static_cast<double>(budget_ns_ - min_ns));
  }

  [[nodiscard]] std::int64_t cost_of_raise(std::size_t item, std::uint8_t from, std::uint8_t to) const {
    return s_.items[item].cost_ns[to] - s_.items[item].cost_ns[from];
  }

  // The rung of the level and stride that chosen_ has for the item.
  [[nodiscard]] std::uint8_t chosen_rung(const BudgetItem& item) const {
    return rung_of(chosen_[item.character], ladder_of(characters_[item.character]));
  }

  // Whether the character may change its level: see kLodDwell_s. A suspended one may always.
  [[nodiscard]] bool has_dwelt(const BudgetItem& item) const {
    const BudgetCharacter& c = characters_[item.character];
    return c.since_s >= kLodDwell_s || c.now.suspended;
  }

  void set(std::size_t item, std::uint8_t rung) {
    const BudgetItem& i = s_.items[item];
    HAIRNET_ASSERT(rung <= i.last);
    const Rung& r = kLadders[ladder_of(characters_[i.character])][rung];
    chosen_[i.character] = {r.level, r.stride, false};
  }

  BudgetReport finish() const {
    BudgetReport report;
    std::int64_t sum_ns = 0;
    for (const BudgetItem& item : s_.items) {
      const std::uint8_t rung = chosen_rung(item);
      sum_ns += item.cost_ns[rung];
      report.raised += rung > item.now;
      report.lowered += rung < item.now;
      report.below_wanted += rung < item.last;
    }
    report.predicted_s = 1e-9 * static_cast<double>(sum_ns);
    report.wanted_s = 1e-9 * static_cast<double>(wanted_ns_);
    report.is_over = sum_ns > budget_ns_;
    return report;
  }

  const BudgetTerms& terms_;
  std::span<const BudgetCharacter> characters_;
  BudgetScratch& s_;
  std::span<Lod> chosen_;
  // The time that a tick has for its characters, and the time that all items would take on their last rung.
  std::int64_t budget_ns_;
  std::int64_t wanted_ns_ = 0;
  // The sum of the costs of the rungs chosen so far.
  std::int64_t sum_ns_ = 0;
};

}  // namespace

double expected_error(LevelIndex level, int stride) {
  return error_of(level, stride);
}

BudgetReport choose_levels(const BudgetTerms& terms, std::span<const BudgetCharacter> characters,
                           BudgetScratch& scratch, std::span<Lod> chosen) {
  HAIRNET_ASSERT(terms.cost);
  HAIRNET_ASSERT(chosen.size() == characters.size());
  return Chooser(terms, characters, scratch, chosen).run();
}

}  // namespace hairnet::server
