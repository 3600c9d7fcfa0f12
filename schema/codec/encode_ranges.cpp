#include <algorithm>

#include "core/assert.hpp"
#include "schema/codec/frame_nodes.hpp"

namespace hairnet::codec {

std::vector<EncodedRange> encode_ranges(const FrameIntegers& frame, History history, const Neighbours* neighbours,
                                        std::size_t bytes_max) {
  HAIRNET_ASSERT(bytes_max >= kRangeBytesMin);
  const auto node_count = static_cast<std::uint32_t>(frame.nodes.size() / 3);
  std::vector<EncodedRange> ranges;
  std::uint32_t count = node_count;  // the next count to try: that of the last range that fitted, or the rest
  do {
    EncodedRange& range = ranges.emplace_back();
    const std::uint32_t first =
        ranges.size() == 1 ? 0 : ranges[ranges.size() - 2].nodes.first + ranges[ranges.size() - 2].nodes.count;
    const bool with_bones = first == 0;
    count = std::min(std::max(count, 1u), node_count - first);
    for (;;) {
      range.nodes = {first, count};
      range.bytes.clear();
      append_content(frame, history, neighbours, range.nodes, with_bones, range.bytes);
      if (range.bytes.size() <= bytes_max || count == 0) break;
      // As many as would fit if all nodes had the same size, and a little less.
      count = static_cast<std::uint32_t>(std::uint64_t{count} * bytes_max * 15 / (range.bytes.size() * 16));
    }
    HAIRNET_ASSERT(range.bytes.size() <= bytes_max);
    HAIRNET_ASSERT(range.nodes.count > 0 || with_bones);  // every range makes progress
  } while (ranges.back().nodes.first + ranges.back().nodes.count < node_count);
  HAIRNET_ASSERT(ranges.back().nodes.first + ranges.back().nodes.count == node_count);
  return ranges;
}

}  // namespace hairnet::codec
