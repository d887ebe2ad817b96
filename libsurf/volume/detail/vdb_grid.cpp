#include "libsurf/volume/detail/vdb_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <type_traits>

#include "libsurf/base/error.h"
#include "libsurf/base/escaped.h"
#include "libsurf/volume/detail/vdb_stream.h"

namespace surf::volume {
namespace {

constexpr std::uint64_t kMagic = 0x56444220;
constexpr std::uint32_t kOldestFormat = 222, kNewestFormat = 224;  // 222: masks of values per node
constexpr std::size_t kUuidBytes = 36;

/// An entry of the file's list of grids.
struct Descriptor {
  std::string name;
  std::string type;    ///< "Tree_float_5_4_3"
  std::string parent;  ///< the grid whose tree it shares, "" if it has its own
  bool is_half = false;
  std::uint64_t header = 0, end = 0;  ///< places in the file; 0 in one without offsets
};

/// "vec3s" of "Tree_vec3s_5_4_3".
std::string value_type(const std::string& type) {
  constexpr std::string_view kBegin = "Tree_", kEnd = "_5_4_3";
  if (!type.starts_with(kBegin) || !type.ends_with(kEnd) ||
      type.size() < kBegin.size() + kEnd.size())
    return type;
  return type.substr(kBegin.size(), type.size() - kBegin.size() - kEnd.size());
}

/// For messages: without what makes names unique.
std::string printed(const std::string& name) {
  constexpr std::size_t kLongest = 64;
  return one_line(name.substr(0, std::min(name.find('\x1e'), kLongest)));
}

std::optional<ScalarGrid> new_grid(const std::string& type) {
  if (type == openvdb::FloatGrid::gridType()) return openvdb::FloatGrid::create();
  if (type == openvdb::DoubleGrid::gridType()) return openvdb::DoubleGrid::create();
  if (type == openvdb::Int32Grid::gridType()) return openvdb::Int32Grid::create();
  if (type == openvdb::Int64Grid::gridType()) return openvdb::Int64Grid::create();
  return std::nullopt;
}

Descriptor read_descriptor(VdbStream& stream) {
  constexpr std::string_view kHalf = "_HalfFloat";
  Descriptor out;
  out.name = stream.text();
  out.type = stream.text();
  out.is_half = out.type.ends_with(kHalf);
  if (out.is_half) out.type.resize(out.type.size() - kHalf.size());
  out.parent = stream.text();
  out.header = stream.number<std::uint64_t>();
  stream.skip(sizeof(std::uint64_t));  // where the values begin
  out.end = stream.number<std::uint64_t>();
  return out;
}

/// Returns the grid's class, "" if there is none: nothing else of it is of use here.
std::string read_metadata(VdbStream& stream) {
  std::string grid_class;
  for (auto n = stream.number<std::uint32_t>(); n > 0; --n) {
    const std::string name = stream.text(), type = stream.text();
    if (name == "class" && type == "string")
      grid_class = stream.text();
    else
      stream.skip(stream.number<std::uint32_t>());
  }
  return grid_class;
}

Eigen::Affine3d read_map(VdbStream& stream, const std::string& path, const std::string& grid) {
  const std::string type = stream.text();
  const auto vector = [&] {
    Eigen::Vector3d out;
    stream.read(out.data(), 3 * sizeof(double));
    return out;
  };
  Eigen::Affine3d out = Eigen::Affine3d::Identity();
  if (type == "AffineMap" || type == "UnitaryMap") {  // by rows, for row vectors: transposed
    stream.read(out.matrix().data(), 16 * sizeof(double));
  } else if (type == "TranslationMap") {
    out.translation() = vector();
  } else if (type == "ScaleMap" || type == "UniformScaleMap" || type == "ScaleTranslateMap" ||
             type == "UniformScaleTranslateMap") {
    if (type.ends_with("TranslateMap")) out.translation() = vector();
    out.linear() = vector().asDiagonal();
    stream.skip(4 * 3 * sizeof(double));  // what follows from the scale
  } else if (type == "NonlinearFrustumMap") {
    throw InputError(
        fmt::format("{}: grid '{}' has a frustum for a transform, not an affine map", path, grid));
  } else {
    stream.refuse("a transform of an unknown kind");
  }
  return out;
}

/// -value, also of the least whole number.
template <class Value>
Value negative(Value value) {
  if constexpr (std::is_integral_v<Value>)
    return Value(0 - std::make_unsigned_t<Value>(value));
  else
    return -value;
}

/// Reads a tree's topology, which is all of its nodes, masks and tiles, and then the leaves'
/// values.
template <class Tree>
class TreeReader {
 public:
  using Value = typename Tree::ValueType;
  using Leaf = typename Tree::LeafNodeType;

  TreeReader(VdbStream& stream, std::uint32_t compression, bool is_half)
      : stream_(stream),
        compression_(compression),
        is_half_(is_half && std::is_floating_point_v<Value>) {}

  void read(Tree& tree) {
    stream_.skip(sizeof(std::int32_t));  // of buffers: one
    background_ = stream_.number<Value>();
    tree.root().setBackground(background_, /*updateChildNodes=*/false);
    const auto n_tiles = stream_.number<std::uint32_t>(), n_nodes = stream_.number<std::uint32_t>();
    read_tiles(tree.root(), n_tiles);
    read_nodes(tree.root(), n_nodes);
    for (Leaf* leaf : leaves_) {
      typename Leaf::NodeMaskType is_active;
      read_mask(is_active);
      leaf->setValueMask(is_active);
      read_values(leaf->buffer().data(), is_active);
    }
  }

 private:
  using Root = typename Tree::RootNodeType;
  using Top = typename Root::ChildNodeType;

  /// The next entry of the root. OpenVDB writes them in their order, and the leaves' values in the
  /// same one.
  openvdb::Coord next_origin(std::optional<openvdb::Coord>& before) {
    openvdb::Coord out;
    stream_.read(out.data(), 3 * sizeof(std::int32_t));
    if ((out & (int(Top::DIM) - 1)) != openvdb::Coord() || (before && !(*before < out)))
      stream_.refuse("its nodes are not in place");
    before = out;
    return out;
  }

  void read_tiles(Root& root, std::uint32_t n) {
    for (std::optional<openvdb::Coord> before; n > 0; --n) {
      const openvdb::Coord origin = next_origin(before);
      const auto value = stream_.number<Value>();
      root.addTile(origin, value, stream_.number<std::uint8_t>() != 0);
    }
  }

  void read_nodes(Root& root, std::uint32_t n) {
    for (std::optional<openvdb::Coord> before; n > 0; --n) {
      auto node = std::make_unique<Top>(next_origin(before), background_);
      read_topology(*node);
      root.addChild(node.release());
    }
  }

  template <class Node>
  void read_topology(Node& node) {
    typename Node::NodeMaskType is_child, is_active;
    read_mask(is_child);
    read_mask(is_active);
    std::vector<Value> tiles(Node::NUM_VALUES);
    read_values(tiles.data(), is_active);
    for (openvdb::Index n = 0; n < Node::NUM_VALUES; ++n) {
      if (is_child.isOff(n)) {
        node.addTile(n, tiles[n], is_active.isOn(n));
        continue;
      }
      auto child =
          std::make_unique<typename Node::ChildNodeType>(node.offsetToGlobalCoord(n), background_);
      read_topology(*child);
      node.addChild(child.release());
    }
  }

  /// Its mask comes again with its values.
  void read_topology(Leaf& leaf) {
    stream_.skip(sizeof(typename Leaf::NodeMaskType));
    leaves_.push_back(&leaf);
  }

  template <class Mask>
  void read_mask(Mask& mask) {
    stream_.read(&mask.template getWord<std::uint64_t>(0), mask.memUsage());
  }

  /// The values of a node's places. A byte says what the inactive ones are, which need not be
  /// there: all the background (0) or its negative (1) or another value (2); or one of two by a
  /// mask, namely those (3), another and the background (4), two others (5); 6 where all are there.
  template <class Mask>
  void read_values(Value* out, const Mask& is_active) {
    const auto kind = stream_.number<std::uint8_t>();
    if (kind > 6) stream_.refuse(fmt::format("values of the unknown kind {}", kind));
    Value inactive[2] = {kind == 0 ? background_ : negative(background_), background_};
    if (kind == 2 || kind == 4 || kind == 5) inactive[0] = stream_.number<Value>();
    if (kind == 5) inactive[1] = stream_.number<Value>();
    Mask is_second;
    if (kind >= 3 && kind <= 5) read_mask(is_second);
    const bool is_all = !(compression_ & kActiveValuesOnly) || kind == 6;
    const std::size_t n_stored = is_all ? Mask::SIZE : is_active.countOn();
    if (n_stored == Mask::SIZE) return unpack(out, n_stored);
    stored_.resize(n_stored);
    unpack(stored_.data(), n_stored);
    auto next = stored_.begin();
    for (openvdb::Index n = 0; n < Mask::SIZE; ++n)
      out[n] = is_active.isOn(n) ? *next++ : inactive[is_second.isOn(n)];
  }

  void unpack(Value* out, std::size_t n) {
    if (!is_half_) return stream_.unpack(out, n * sizeof(Value), compression_);
    if (n == 0) return;  // not even the size of what is packed
    halves_.resize(n);
    stream_.unpack(halves_.data(), n * sizeof(halves_[0]), compression_);
    std::transform(halves_.begin(), halves_.end(), out,
                   [](openvdb::math::half value) { return Value(float(value)); });
  }

  VdbStream& stream_;
  std::uint32_t compression_;
  bool is_half_;
  Value background_ = Value(0);
  std::vector<Leaf*> leaves_;  ///< in their order
  std::vector<Value> stored_;
  std::vector<openvdb::math::half> halves_;
};

/// What the file says before its first grid.
struct Head {
  bool has_offsets = true;  ///< else it was written into a pipe, and grids follow without a gap
  int n_grids = 0;
};

Head read_head(VdbStream& stream, const std::string& path) {
  if (stream.number<std::uint64_t>() != kMagic) stream.refuse("it does not begin as one");
  const auto format = stream.number<std::uint32_t>();
  if (format < kOldestFormat || format > kNewestFormat)
    throw InputError(
        fmt::format("{}: is of the OpenVDB file format {}, surfseg reads {} to {}; save it with "
                    "another version "
                    "of OpenVDB",
                    path, format, kOldestFormat, kNewestFormat));
  stream.skip(2 * sizeof(std::uint32_t));  // the library's version
  Head out;
  out.has_offsets = stream.number<std::uint8_t>() != 0;
  stream.skip(kUuidBytes);
  read_metadata(stream);
  out.n_grids = stream.number<std::int32_t>();
  return out;
}

VdbGrid read_grid(VdbStream& stream, const std::string& path, const Descriptor& descriptor,
                  const ScalarGrid& grid) {
  if (!descriptor.parent.empty())  // which would be before it, and a scalar grid
    stream.refuse(fmt::format("grid '{}' has the voxels of another that is not there",
                              printed(descriptor.name)));
  VdbGrid out;
  out.name = printed(descriptor.name);
  out.scalar_type = value_type(descriptor.type);
  if (out.scalar_type == "float") out.scalar_type = "float32";
  if (out.scalar_type == "double") out.scalar_type = "float64";
  const auto compression = stream.number<std::uint32_t>();
  out.is_level_set = read_metadata(stream) == "level set";
  out.index_to_world = read_map(stream, path, out.name);
  out.grid = grid;
  std::visit(
      [&](const auto& typed) {
        using Tree = typename std::decay_t<decltype(*typed)>::TreeType;
        TreeReader<Tree>(stream, compression, descriptor.is_half).read(typed->tree());
      },
      grid);
  return out;
}

}  // namespace

VdbGrid read_vdb_grid(const std::string& path) {
  constexpr std::size_t kLongestList = 200;
  std::optional<VdbStream> stream(std::in_place, path, 0);
  const Head head = read_head(*stream, path);
  std::string others;
  std::uint64_t end = 0;
  for (int n = 0; n < head.n_grids; ++n) {
    if (n > 0) stream.emplace(path, end);
    const Descriptor descriptor = read_descriptor(*stream);
    if (const auto grid = new_grid(descriptor.type)) {
      if (head.has_offsets) stream.emplace(path, descriptor.header);
      VdbGrid out = read_grid(*stream, path, descriptor, *grid);
      out.n_grids = head.n_grids;
      return out;
    }
    if (others.size() < kLongestList)
      others +=
          fmt::format(" '{}' ({})", printed(descriptor.name), printed(value_type(descriptor.type)));
    if (!head.has_offsets) break;  // it cannot be passed over
    if (descriptor.end <= end) stream->refuse("its grids do not follow one another");
    end = descriptor.end;
  }
  throw InputError(fmt::format("{}: has no scalar grid (float, double, int32, int64){}{}", path,
                               others.empty()     ? ""
                               : head.has_offsets ? ", only"
                                                  : " at its begin, but",
                               others));
}

}  // namespace surf::volume
