#include "libsurf/segment/energy_kind.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <mutex>

#include "libsurf/base/error.h"
#include "libsurf/base/nearest_name.h"
#include "libsurf/segment/detail/built_in_kinds.h"

namespace surf::segment {
namespace {

bool is_name(const std::string& text) {
  const auto is_allowed = [](unsigned char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
  };
  return !text.empty() && std::all_of(text.begin(), text.end(), is_allowed);
}

/// Empty if the kind can be registered.
template <int Dim>
std::string error_of(const EnergyKind<Dim>& kind) {
  if (!is_name(kind.name) || kind.name == "auto" || kind.name == "list")
    return fmt::format("energy kind '{}': this cannot be a name", kind.name);
  if (!kind.build) return fmt::format("energy kind {}: build is missing", kind.name);
  for (auto p = kind.parameters.begin(); p != kind.parameters.end(); ++p) {
    const auto fault = [&](const char* what) {
      return fmt::format("energy kind {}: parameter '{}' {}", kind.name, p->key, what);
    };
    if (!is_name(p->key) || p->key == "weight") return fault("cannot have this name");
    if (std::any_of(kind.parameters.begin(), p, [&](const auto& q) { return q.key == p->key; }))
      return fault("is there twice");
    if (p->standard.constant && !p->range.contains(*p->standard.constant))
      return fault("has a default outside its range");
  }
  return {};
}

template <int Dim>
class Registry {
 public:
  static Registry& instance() {
    static Registry registry;
    return registry;
  }

  void add(EnergyKind<Dim> kind) {
    if (const std::string error = error_of(kind); !error.empty()) throw UsageError(error);
    const std::lock_guard lock(mutex_);
    if (at(kind.name))
      throw UsageError(fmt::format("energy kind {}: there is one of this name", kind.name));
    kinds_.push_back(std::move(kind));
  }

  /// Null if there is none.
  const EnergyKind<Dim>* find(const std::string& name) const {
    const std::lock_guard lock(mutex_);
    return at(name);
  }

  std::vector<const EnergyKind<Dim>*> all() const {
    const std::lock_guard lock(mutex_);
    std::vector<const EnergyKind<Dim>*> out;
    for (const EnergyKind<Dim>& kind : kinds_) out.push_back(&kind);
    return out;
  }

 private:
  Registry() {
    for (auto family : {edge_kinds<Dim>(), shape_kinds<Dim>(), region_kinds<Dim>()})
      for (EnergyKind<Dim>& kind : family) add(std::move(kind));
  }

  const EnergyKind<Dim>* at(const std::string& name) const {
    const auto kind = std::find_if(kinds_.begin(), kinds_.end(),
                                   [&](const EnergyKind<Dim>& k) { return k.name == name; });
    return kind == kinds_.end() ? nullptr : &*kind;
  }

  mutable std::mutex mutex_;
  std::deque<EnergyKind<Dim>> kinds_;  // what has been found stays where it is
};

template <int Dim>
std::vector<std::string> sorted_names() {
  std::vector<std::string> names;
  for (const EnergyKind<Dim>* kind : all_kinds<Dim>()) names.push_back(kind->name);
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

bool ParameterRange::contains(double value) const {
  if (!std::isfinite(value)) return false;
  if (!values.empty()) return std::find(values.begin(), values.end(), value) != values.end();
  return (excludes_lowest ? value > lowest : value >= lowest) && value <= highest;
}

std::string ParameterRange::text() const {
  if (!values.empty()) return fmt::format("{}", fmt::join(values, ", "));
  std::string out;
  if (std::isfinite(lowest)) out = fmt::format("{} {}", excludes_lowest ? ">" : ">=", lowest);
  if (std::isfinite(highest)) out += fmt::format("{}<= {}", out.empty() ? "" : ", ", highest);
  return out.empty() ? "any number" : out;
}

std::string ParameterRange::violation() const {
  return (values.empty() ? "violates " : "is none of ") + text();
}

template <int Dim>
ParameterDefault<Dim> ParameterDefault<Dim>::of(double value) {
  return {value, {}, fmt::format("{}", value)};
}

template <int Dim>
ParameterDefault<Dim> ParameterDefault<Dim>::chosen(Choice choice, std::string text) {
  return {{}, std::move(choice), std::move(text)};
}

template <int Dim>
ParameterDefault<Dim> ParameterDefault<Dim>::absent(std::string text) {
  return {{}, {}, std::move(text)};
}

template <int Dim>
const KindParameter<Dim>* EnergyKind<Dim>::find_parameter(const std::string& key) const {
  const auto at = std::find_if(parameters.begin(), parameters.end(),
                               [&](const KindParameter<Dim>& p) { return p.key == key; });
  return at == parameters.end() ? nullptr : &*at;
}

template <int Dim>
void register_kind(EnergyKind<Dim> kind) {
  Registry<Dim>::instance().add(std::move(kind));
}

template <int Dim>
const EnergyKind<Dim>& find_kind(const std::string& name) {
  if (const EnergyKind<Dim>* kind = Registry<Dim>::instance().find(name)) return *kind;
  constexpr int kOther = Dim == 2 ? 3 : 2;
  if (Registry<kOther>::instance().find(name))
    throw UsageError(fmt::format("energy '{}' is there for {} only; here there are {}", name,
                                 Dim == 2 ? "volumes" : "images", known_energies<Dim>()));
  const std::string nearest = did_you_mean(name, sorted_names<Dim>());
  throw UsageError(fmt::format("energy '{}' is unknown{} are {}", name,
                               nearest.empty() ? "; there" : nearest + " There",
                               known_energies<Dim>()));
}

template <int Dim>
std::vector<const EnergyKind<Dim>*> all_kinds() {
  return Registry<Dim>::instance().all();
}

template <int Dim>
std::string known_energies() {
  std::vector<std::string> names = sorted_names<Dim>();
  const std::string last = names.back();
  names.pop_back();
  return fmt::format("{} and {}", fmt::join(names, ", "), last);
}

template struct ParameterDefault<2>;
template struct ParameterDefault<3>;
template struct EnergyKind<2>;
template struct EnergyKind<3>;
template void register_kind<2>(EnergyKind<2>);
template void register_kind<3>(EnergyKind<3>);
template const EnergyKind<2>& find_kind<2>(const std::string&);
template const EnergyKind<3>& find_kind<3>(const std::string&);
template std::vector<const EnergyKind<2>*> all_kinds<2>();
template std::vector<const EnergyKind<3>*> all_kinds<3>();
template std::string known_energies<2>();
template std::string known_energies<3>();

}  // namespace surf::segment
