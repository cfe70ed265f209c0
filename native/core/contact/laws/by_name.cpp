#include "contact/laws/by_name.hpp"

#include <cstring>

namespace mjtactile {
namespace {

const ContactLaw* const kLaws[] = {&elastic_law(), &foundation_law(), &uniform_law()};
const TangentialChoice* const kTangentials[] = {&proportional_shear(), &stick_shear(), &coulomb_shear()};

template <typename One, std::size_t count>
const One* named(const One* const (&all)[count], const char* name) {
  for (const One* one : all) {
    if (std::strcmp(one->name(), name) == 0) return one;
  }
  return nullptr;
}

}  // namespace

const ContactLaw* law_named(const char* name) { return named(kLaws, name); }

const TangentialChoice* tangential_named(const char* name) { return named(kTangentials, name); }

}  // namespace mjtactile
