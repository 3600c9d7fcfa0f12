#include "schema/channel/flat_json.hpp"

#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::channel {
namespace {

// The claims of a token need two levels. The limit bounds the nesting of a text that an attacker has made.
constexpr int kDepthMax = 8;

// Collects the members of the outer object while nlohmann's parser calls the handlers. Each handler returns whether to
// continue; the first false ends the parse.
class Collector final : public nlohmann::json_sax<nlohmann::json> {
 public:
  // Asserts that the parse has ended.
  FlatJson take() {
    HAIRNET_ASSERT(depth_ == 0);
    HAIRNET_ASSERT(!list_);
    return std::move(members_);
  }

  bool null() override { return put(std::monostate()); }
  bool boolean(bool value) override { return put(value); }
  bool number_integer(std::int64_t value) override { return put(value); }
  bool number_unsigned(std::uint64_t value) override {
    constexpr std::uint64_t kMax = std::numeric_limits<std::int64_t>::max();
    // A number beyond int64 becomes a double, as a number with a fraction does.
    return value > kMax ? put(static_cast<double>(value)) : put(static_cast<std::int64_t>(value));
  }
  bool number_float(double value, const std::string&) override { return put(value); }
  bool string(std::string& value) override {
    // Only a text directly in a list of the outer object is kept; text deeper inside is passed over by put().
    if (depth_ != 2 || !list_) return put(std::move(value));
    list_->push_back(std::move(value));
    return true;
  }
  // JSON text has no binary values.
  bool binary(nlohmann::json::binary_t&) override { return false; }
  bool start_object(std::size_t) override {
    if (depth_ == 1) put(std::monostate());
    corrupt_list();
    return ++depth_ <= kDepthMax;
  }
  bool end_object() override { return leave(); }
  bool start_array(std::size_t) override {
    // The text must be an object, and not a list.
    if (depth_ == 0) return false;
    corrupt_list();
    if (depth_ == 1) {
      put(std::vector<std::string>());
      list_ = std::get_if<std::vector<std::string>>(&members_.at(name_));
      HAIRNET_ASSERT(list_);
    }
    return ++depth_ <= kDepthMax;
  }
  bool end_array() override { return leave(); }
  bool key(std::string& name) override {
    HAIRNET_ASSERT(depth_ >= 1);
    if (depth_ != 1) return true;
    name_ = std::move(name);
    // A name that stands twice is refused: another reader of the same token might take the other value.
    return !members_.contains(name_);
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

 private:
  template <class T>
  bool put(T value) {
    if (depth_ == 0) return false;
    if (depth_ == 1) members_[name_] = std::move(value);
    corrupt_list();
    return true;
  }
  // Turns the list that is being read into monostate, as it has an element that is not text.
  void corrupt_list() {
    if (depth_ < 2 || !list_) return;
    list_ = nullptr;
    members_[name_] = std::monostate();
  }
  bool leave() {
    HAIRNET_ASSERT(depth_ >= 1);
    if (--depth_ == 1) list_ = nullptr;
    return true;
  }

  // How many objects and lists are open.
  int depth_ = 0;
  // The name of the outer object's member that is being read.
  std::string name_;
  FlatJson members_;
  // The list of texts that is being read; null outside of such lists.
  std::vector<std::string>* list_ = nullptr;
};

}  // namespace

std::optional<FlatJson> parse_flat_json(std::string_view text) {
  Collector collector;
  if (!nlohmann::json::sax_parse(text.begin(), text.end(), &collector)) return std::nullopt;
  return collector.take();
}

}  // namespace hairnet::channel
