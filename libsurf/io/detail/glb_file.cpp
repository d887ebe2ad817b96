#include "libsurf/io/detail/glb_file.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "libsurf/base/error.h"
#include "libsurf/io/detail/colour.h"

namespace surf::io {
namespace {

using Json = nlohmann::ordered_json;
using Floats = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Of glTF 2.0.
constexpr std::uint32_t kMagic = 0x46546c67, kVersion = 2, kJsonChunk = 0x4e4f534a,
                        kBinaryChunk = 0x004e4942;
constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementBuffer = 34963;

template <class T>
void append(std::string& bytes, const T* values, std::size_t n) {
  bytes.append(reinterpret_cast<const char*>(values), n * sizeof(T));
}

void append_chunk(std::string& bytes, std::uint32_t kind, std::string chunk, char filler) {
  chunk.resize((chunk.size() + 3) / 4 * 4, filler);
  const std::uint32_t head[] = {std::uint32_t(chunk.size()), kind};
  append(bytes, head, 2);
  bytes += chunk;
}

Points<3> mean_normals(const Triangles& surface) {
  Points<3> out = Points<3>::Zero(surface.points.rows(), 3);
  for (const auto t : surface.elements.rowwise()) {
    const Vector<3> a = surface.points.row(t[0]), b = surface.points.row(t[1]),
                    c = surface.points.row(t[2]);
    for (int i = 0; i < 3; ++i) out.row(t[i]) += (b - a).cross(c - a).transpose();
  }
  for (auto normal : out.rowwise()) {
    const double length = normal.norm();
    if (length > 0)
      normal /= length;
    else
      normal = Eigen::RowVector3d::UnitZ();  // glTF wants unit ones
  }
  return out;
}

/// Column by column, from millimetres of the file's frame to glTF's metres.
std::array<double, 16> to_metres(Space space) {
  const double m = 1e-3, s = space == Space::kLps ? 1 : -1;  // LPS: left is +X, anterior is -Y
  return {s * m, 0, 0, 0, 0, 0, -s * m, 0, 0, m, 0, 0, 0, 0, 0, 1};
}

/// sRGB to linear, as glTF's factors are.
double linear(std::uint8_t value) {
  const double v = value / 255.0;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

/// The binary chunk and what the JSON says of it.
class Buffer {
 public:
  int add_vectors(const Floats& values, bool has_bounds) {
    Json accessor = {
        {"bufferView", add_view(values.data(), std::size_t(values.size()), kArrayBuffer)},
        {"componentType", kFloat},
        {"count", values.rows()},
        {"type", values.cols() == 3 ? "VEC3" : "SCALAR"}};
    if (has_bounds) {
      const Eigen::RowVectorXf low = values.colwise().minCoeff(),
                               high = values.colwise().maxCoeff();
      accessor["min"] = std::vector<float>(low.begin(), low.end());
      accessor["max"] = std::vector<float>(high.begin(), high.end());
    }
    accessors_.push_back(std::move(accessor));
    return int(accessors_.size()) - 1;
  }
  int add_indices(const Elements<3>& elements) {
    std::vector<std::uint32_t> indices;
    for (const auto t : elements.rowwise())
      for (const int vertex : t) indices.push_back(std::uint32_t(vertex));
    accessors_.push_back({{"bufferView", add_view(indices.data(), indices.size(), kElementBuffer)},
                          {"componentType", kUnsignedInt},
                          {"count", indices.size()},
                          {"type", "SCALAR"}});
    return int(accessors_.size()) - 1;
  }
  const Json& views() const { return views_; }
  const Json& accessors() const { return accessors_; }
  const std::string& bytes() const { return bytes_; }

 private:
  template <class T>
  int add_view(const T* values, std::size_t n, int target) {
    views_.push_back({{"buffer", 0},
                      {"byteOffset", bytes_.size()},
                      {"byteLength", n * sizeof(T)},
                      {"target", target}});
    append(bytes_, values, n);
    return int(views_.size()) - 1;
  }

  std::string bytes_;
  Json views_ = Json::array(), accessors_ = Json::array();
};

std::string attribute_name(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return char(std::toupper(c)); });
  return "_" + name;
}

}  // namespace

std::string glb_bytes(const Triangles& surface, const WriteOptions& options) {
  Buffer buffer;
  Json attributes = {{"POSITION", buffer.add_vectors(surface.points.cast<float>(), true)},
                     {"NORMAL", buffer.add_vectors(mean_normals(surface).cast<float>(), false)}};
  for (const PointArray& array : options.arrays)
    attributes[attribute_name(array.name)] = buffer.add_vectors(array.values.cast<float>(), false);
  const int indices = buffer.add_indices(surface.elements);
  const auto colour = options.colour.value_or(kBone);
  const Json material = {
      {"pbrMetallicRoughness",
       {{"baseColorFactor", {linear(colour[0]), linear(colour[1]), linear(colour[2]), 1.0}},
        {"metallicFactor", 0},
        {"roughnessFactor", 0.6}}}};
  const Json json = {
      {"asset",
       {{"version", "2.0"},
        {"generator", "surfseg"},
        {"extras", {{"space", name(options.space)}, {"unit", "mm"}}}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", {{{"mesh", 0}, {"matrix", to_metres(options.space)}}}},
      {"meshes",
       {{{"name", options.name.empty() ? "surface" : options.name},
         {"primitives", {{{"attributes", attributes}, {"indices", indices}, {"material", 0}}}}}}},
      {"materials", {material}},
      {"accessors", buffer.accessors()},
      {"bufferViews", buffer.views()},
      {"buffers", {{{"byteLength", buffer.bytes().size()}}}}};
  std::string chunks;
  // Names need not be UTF-8.
  append_chunk(chunks, kJsonChunk,
               json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace), ' ');
  append_chunk(chunks, kBinaryChunk, buffer.bytes(), '\0');
  if (chunks.size() > 0xffffffffu - 12) throw OutputError("a .glb file holds at most 4 GB");
  const std::uint32_t head[] = {kMagic, kVersion, std::uint32_t(12 + chunks.size())};
  std::string out;
  append(out, head, 3);
  return out + chunks;
}

}  // namespace surf::io
