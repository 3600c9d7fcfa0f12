#include "tests/support/corrupted_grooms.hpp"

#include <algorithm>
#include <cstring>
#include <span>

#include "core/assert.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/groom_numbers.hpp"
#include "schema/wire/packing.hpp"
#include "tests/support/random_messages.hpp"

namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

// What the decoder says (schema/wire/packing.cpp). kOtherSize: unpacking gives another size than the file states.
// kImpossibleSize: no stream of these bytes can unpack to that size.
constexpr const char* kOtherSize = "its stream is not as long as it says";
constexpr const char* kImpossibleSize = "its stream cannot be as long as it says";

void put_u32(Bytes& bytes, std::size_t at, std::size_t value) {
  const auto number = static_cast<std::uint32_t>(value);
  std::memcpy(bytes.data() + at, &number, sizeof number);
}

std::uint32_t u32_at(const Bytes& bytes, std::size_t at) {
  std::uint32_t number = 0;
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

// Takes a packed file apart. The compressed stream comes last, after its size, and up to 7 bytes of padding may follow.
class PackedFile {
 public:
  explicit PackedFile(const Bytes& file) : head_(file) {
    // The size of the stream is the number that leads to the end of the file, but for the padding.
    std::size_t at = 12;
    while (at + 4 + u32_at(file, at) > file.size() || at + 4 + u32_at(file, at) + 8 <= file.size()) ++at;
    head_.resize(at + 4);
    stream_.assign(file.begin() + static_cast<std::ptrdiff_t>(at + 4),
                   file.begin() + static_cast<std::ptrdiff_t>(at + 4 + u32_at(file, at)));
    size_ = unpacked_bytes(file, kPackedGroom);
  }
  [[nodiscard]] const Bytes& stream() const { return stream_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] Bytes with_stream(const Bytes& stream) const {
    Bytes file = head_;
    put_u32(file, file.size() - 4, stream.size());
    file.insert(file.end(), stream.begin(), stream.end());
    put_u32(file, 0, file.size() - 4);
    return file;
  }
  [[nodiscard]] Bytes with_size(std::size_t size) const {
    Bytes file = with_stream(stream_);
    std::size_t at = 12;
    while (u32_at(file, at) != size_) ++at;
    put_u32(file, at, size);
    return file;
  }

 private:
  Bytes head_, stream_;
  std::size_t size_ = 0;
};

// Returns the file of a table in which a vector of bytes was corrupted. `corrupt` gets the vector's place; the number
// before that place is its size.
Bytes with_vector(Bytes table, const Bytes& vector, auto corrupt) {
  const auto found = std::search(table.begin(), table.end(), vector.begin(), vector.end());
  HAIRNET_ASSERT(found != table.end());
  corrupt(table, static_cast<std::size_t>(found - table.begin()));
  return pack(table, kPackedGroom);
}

std::vector<std::uint32_t> tied_points(const Groom& groom) {
  std::vector<std::uint32_t> tied;
  for (const Knot& knot : groom.knots) tied.insert(tied.end(), knot.points.begin(), knot.points.end());
  return tied;
}

// Draws a random groom that has threads, cards and at least 8 tied points, so that their bytes are found in the file at
// one place only.
Groom make_groom() {
  RandomMessages random(12);
  Groom groom = random.groom(100);
  while (groom.threads.empty() || groom.cards.empty() || tied_points(groom).size() < 8) groom = random.groom(100);
  return groom;
}

void add_streams(const Bytes& good, std::vector<CorruptedGroom>& all) {
  const PackedFile file(good);
  for (const std::size_t size : {file.size() - 1, file.size() + 1, file.size() / 2, 2 * file.size(), std::size_t{100}})
    all.push_back({"unpacks to " + std::to_string(size) + " bytes", file.with_size(size), kOtherSize});
  for (const std::size_t size : {std::size_t{0}, std::size_t{200'000'000}})
    all.push_back({"unpacks to " + std::to_string(size) + " bytes", file.with_size(size), kImpossibleSize});
  // These sizes are more than a groom may have, and must be refused before memory is taken for them.
  for (const std::size_t size : {kGroomBytesMax + std::size_t{1}, std::size_t{0xFFFFFFFF}})
    all.push_back({"unpacks to " + std::to_string(size) + " bytes", file.with_size(size), "bytes when unpacked"});
  const auto add = [&](const char* name, const char* error, auto corrupt) {
    Bytes stream = file.stream();
    corrupt(stream);
    all.push_back({name, file.with_stream(stream), error});
  };
  add("a stream without its last byte", kOtherSize, [](Bytes& stream) { stream.pop_back(); });
  add("half a stream", kOtherSize, [](Bytes& stream) { stream.resize(stream.size() / 2); });
  add("no stream", kImpossibleSize, [](Bytes& stream) { stream.clear(); });
  add("a byte after the stream", kOtherSize, [](Bytes& stream) { stream.push_back(0); });
  add("bytes after the stream", kOtherSize, [](Bytes& stream) { stream.resize(stream.size() + 100, 0x55); });
  add("a second stream", kOtherSize,
      [&](Bytes& stream) { stream.insert(stream.end(), file.stream().begin(), file.stream().end()); });
  // A zlib stream has a header of two bytes. 0xFF after it begins a block of a kind that does not exist.
  add("a damaged stream", "its stream is damaged", [](Bytes& stream) { stream.at(2) = 0xFF; });
  all.push_back({"a packed file in a packed file", pack(good, kPackedGroom), "not whole"});
}

void add_numbers(const Groom& groom, const Bytes& table, std::vector<CorruptedGroom>& all) {
  const EncodedPoints points = encode_points(groom.points, point_runs(groom));
  const Bytes tied = encode_indices(tied_points(groom));
  // shorten() lowers the vector's size, which stands in the four bytes before the vector. refer() changes the
  // reference of one run.
  const auto shorten = [](std::size_t bytes) {
    return [bytes](Bytes& in, std::size_t at) { put_u32(in, at - 4, u32_at(in, at - 4) - bytes); };
  };
  const auto refer = [](std::size_t run, std::uint8_t folded) {
    return [=](Bytes& in, std::size_t at) {
      // A run has a reference of 3 bytes, and the references lie by byte: all low bytes first, then the middle ones,
      // then the high ones. `folded` becomes the low byte: 2 means one run before, 4 two runs before, and 1 one run
      // after.
      const std::size_t run_count = u32_at(in, at - 4) / 3;
      in[at + run] = folded;
      in[at + run_count + run] = in[at + 2 * run_count + run] = 0;
    };
  };
  const std::size_t first_card = groom.strand_count() + groom.threads.size();
  const auto add = [&](const char* name, const char* error, const Bytes& vector, auto corrupt) {
    all.push_back({name, with_vector(table, vector, corrupt), error});
  };
  add("points cut off", " points, not ", points.planes, shorten(1));
  add("references cut off", " references, not ", points.references, shorten(3));
  add("a reference before the first run", "do not come before", points.references, refer(0, 2));
  add("a reference to a later run", "do not come before", points.references, refer(1, 1));
  add("a card's reference to a thread", "of another kind", points.references, refer(first_card, 2));
  add("tied points cut off", "indices are not whole", tied, shorten(1));
  add("fewer tied points than counted", "fewer tied points", tied, shorten(3));
}

}  // namespace

std::vector<CorruptedGroom> corrupted_grooms() {
  const Groom groom = make_groom();
  const Bytes good = encode_groom(groom);
  std::vector<CorruptedGroom> all;
  add_streams(good, all);
  add_numbers(groom, unpack(good, kPackedGroom).value(), all);
  return all;
}

}  // namespace hairnet::wire
