#include "client/assets/import/ogawa.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "client/assets/import/byte_reader.hpp"

// 8 bytes of header, the place of the root group, and then groups and blocks in any order. A group is a count and a
// word for each child: a place in the file, with the highest bit set for a block of data. A block is its size and its
// bytes. Place 0 is an empty group or block.
namespace hairnet {
namespace {

// The depth bounds the memory of the walk, and of all that later follow the tree.
constexpr std::size_t kOgawaHeaderBytes = 16, kGroupDepthMax = 256, kWordBytes = 8;
constexpr std::uint64_t kDataBit = std::uint64_t{1} << 63;
constexpr std::array<unsigned char, 5> kOgawaMagic{'O', 'g', 'a', 'w', 'a'};
constexpr std::array<unsigned char, 4> kHdf5Magic{0x89, 'H', 'D', 'F'};

template <std::size_t size>
bool begins_with(std::span<const std::byte> bytes, const std::array<unsigned char, size>& magic) {
  return bytes.size() >= size &&
         std::equal(magic.begin(), magic.end(), bytes.begin(),
                    [](unsigned char a, std::byte b) { return a == std::to_integer<unsigned char>(b); });
}

std::string at_byte(std::uint64_t at) {
  return " at byte " + std::to_string(at);
}

}  // namespace

// No check is necessary: OgawaCheck has walked over this word.
std::uint64_t OgawaGroup::child_word(std::size_t child) const {
  return ByteReader(file_, at_ + 8 + 8 * child).u64();
}

bool OgawaGroup::is_group(std::size_t child) const {
  return child < child_count_ && (child_word(child) & kDataBit) == 0;
}

bool OgawaGroup::is_data(std::size_t child) const {
  return child < child_count_ && (child_word(child) & kDataBit) != 0;
}

OgawaGroup OgawaGroup::group(std::size_t child) const {
  if (!is_group(child) || child_word(child) == 0) return {};
  const auto at = static_cast<std::size_t>(child_word(child));
  return {file_, at, static_cast<std::size_t>(ByteReader(file_, at).u64())};
}

std::span<const std::byte> OgawaGroup::data(std::size_t child) const {
  if (!is_data(child) || child_word(child) == kDataBit) return {};
  const auto at = static_cast<std::size_t>(child_word(child) & ~kDataBit);
  return file_.subspan(at + 8, static_cast<std::size_t>(ByteReader(file_, at).u64()));
}

// Walks the tree with a stack of its own, because a crafted file could nest groups deep enough to exhaust the
// program's.
class OgawaCheck {
 public:
  explicit OgawaCheck(std::span<const std::byte> file) : file_(file), words_left_(file.size() / kWordBytes) {}

  // Returns an empty string when the tree is valid.
  std::string check(std::uint64_t root) {
    std::string error = enter(root);
    while (error.empty() && !path_.empty()) {
      Step& step = path_.back();
      if (step.next == step.group.child_count()) {
        path_.pop_back();
        continue;
      }
      const std::uint64_t word = step.group.child_word(step.next++);
      if ((word & kDataBit) != 0) {
        error = check_data(word & ~kDataBit);
      } else if (word != 0) {
        error = enter(word);
      }
    }
    return error;
  }

 private:
  struct Step {
    OgawaGroup group;
    std::size_t next = 0;
  };

  // Whether a word of 8 bytes lies there, behind the header.
  [[nodiscard]] bool has_word(std::uint64_t at) const {
    return at >= kOgawaHeaderBytes && file_.size() >= 8 && at <= file_.size() - 8;
  }

  std::string enter(std::uint64_t at) {
    if (!has_word(at)) return "damaged: a group" + at_byte(at) + " lies outside of the file";
    ByteReader in(file_, static_cast<std::size_t>(at));
    const std::uint64_t count = in.u64();
    // The comparison divides, so a count near 2^64 cannot wrap around.
    if (!in.has(count, 8))
      return "damaged: the group" + at_byte(at) + " says it has " + std::to_string(count) +
             " children, more than the file has room for";
    // A cycle would make all later walks endless. Only ancestors are compared: groups that share children are legal.
    const bool is_ancestor = std::ranges::any_of(path_, [&](const Step& step) { return step.group.at_ == at; });
    if (is_ancestor) return "damaged: the group" + at_byte(at) + " lies within itself";
    if (path_.size() == kGroupDepthMax)
      return "its groups lie within each other deeper than " + std::to_string(kGroupDepthMax);
    // Two groups that each have the same two groups as children double the walk at every depth. The budget of words
    // stops this.
    if (count + 1 > words_left_) return "damaged: its groups share more children than the file has room for";
    words_left_ -= static_cast<std::size_t>(count) + 1;
    path_.push_back({OgawaGroup(file_, static_cast<std::size_t>(at), static_cast<std::size_t>(count))});
    return {};
  }

  [[nodiscard]] std::string check_data(std::uint64_t at) const {
    if (at == 0) return {};
    if (!has_word(at)) return "damaged: a block of data" + at_byte(at) + " lies outside of the file";
    ByteReader in(file_, static_cast<std::size_t>(at));
    const std::uint64_t size = in.u64();
    if (in.has(size, 1)) return {};
    return "damaged: the block of data" + at_byte(at) + " says it has " + std::to_string(size) +
           " bytes, but the file ends after " + std::to_string(in.remaining());
  }

  std::span<const std::byte> file_;
  // Bounds the walk by the file's size, however groups share children.
  std::size_t words_left_;
  std::vector<Step> path_;
};

// Older exporters write Alembic as HDF5, so this error says what helps.
Result<OgawaGroup> open_ogawa(std::span<const std::byte> bytes) {
  if (begins_with(bytes, kHdf5Magic)) return Refusal("HDF5 Alembic is not read: export it as Ogawa");
  if (!begins_with(bytes, kOgawaMagic)) return Refusal("not an Alembic file: it does not begin with Ogawa");
  if (bytes.size() < kOgawaHeaderBytes) return Refusal("truncated: shorter than the header of 16 bytes");
  // A writer sets this byte last. Without it, the program was stopped while it wrote.
  if (bytes[5] != std::byte{0xff}) return Refusal("was not written to its end: export it again");
  const unsigned version = std::to_integer<unsigned>(bytes[6]) << 8 | std::to_integer<unsigned>(bytes[7]);
  if (version != 1) return Refusal("Ogawa version " + std::to_string(version) + " is not read, only version 1");
  const std::uint64_t root = ByteReader(bytes, 8).u64();
  if (std::string error = OgawaCheck(bytes).check(root); !error.empty()) return Refusal(std::move(error));
  const auto at = static_cast<std::size_t>(root);
  return OgawaGroup(bytes, at, static_cast<std::size_t>(ByteReader(bytes, at).u64()));
}

}  // namespace hairnet
