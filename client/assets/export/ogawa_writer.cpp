#include "client/assets/export/ogawa_writer.hpp"

#include "client/assets/export/byte_writer.hpp"

namespace hairnet {
namespace {

// A word is a place in the file; its highest bit marks a block of data. Empty groups and blocks take no bytes.
constexpr OgawaWriter::Word kEmptyGroup = 0, kDataBit = OgawaWriter::Word{1} << 63;

}  // namespace

OgawaWriter::OgawaWriter(OutputFile file) : file_(std::move(file)) {
  write_header(false, kEmptyGroup);
}

// The header has 16 bytes: the name, whether the file is complete, the version of the format as a big-endian number of
// 16 bits, and the word of the root.
void OgawaWriter::write_header(bool is_complete, Word root) {
  constexpr std::uint8_t kComplete = 0xff, kFormatVersion = 1;
  ByteWriter header;
  header.text("Ogawa")
      .put(is_complete ? kComplete : std::uint8_t{0})
      .put(std::uint8_t{0})
      .put(kFormatVersion)
      .put(root);
  write(header.bytes());
}

void OgawaWriter::write(std::span<const std::byte> bytes) {
  file_.write(bytes);
  at_ += bytes.size();
}

OgawaWriter::Word OgawaWriter::data(std::initializer_list<std::span<const std::byte>> parts) {
  // A block of no bytes has the word of place 0, so a file may have thousands of empty dimensions for nothing.
  std::uint64_t size = 0;
  for (const auto& part : parts) size += part.size();
  if (size == 0) return kDataBit;
  const Word word = at_ | kDataBit;
  write(std::as_bytes(std::span(&size, 1)));
  for (const auto& part : parts) write(part);
  return word;
}

OgawaWriter::Word OgawaWriter::group(std::span<const Word> children) {
  if (children.empty()) return kEmptyGroup;
  const Word word = at_;
  const std::uint64_t count = children.size();
  write(std::as_bytes(std::span(&count, 1)));
  write(std::as_bytes(children));
  return word;
}

Result<void> OgawaWriter::finish(Word root) {
  // The byte that marks a file as complete goes out last, with the place of the root.
  file_.go_to_begin();
  write_header(true, root);
  return file_.finish();
}

}  // namespace hairnet
