//! Public items of libraries: those with a `pub` of their own, without restriction.

use syn::visit::{self, Visit};
use syn::{Field, ImplItem, Item, ItemImpl, Visibility};

use crate::members::Member;

/// Number of public items in the library of a crate: functions, methods,
/// types, fields, constants, modules and re-exports, each statement as one.
pub(crate) fn count(member: &Member) -> u64 {
    let library = |source: &&crate::source::Source| {
        source.module.as_ref().is_some_and(|place| place.in_library)
    };
    let mut counter = Counter { count: 0 };
    for item in member.sources.iter().filter(library).flat_map(|source| &source.items) {
        counter.visit_item(item);
    }
    counter.count
}

struct Counter {
    count: u64,
}

impl Counter {
    fn add(&mut self, visibility: &Visibility) {
        if matches!(visibility, Visibility::Public(_)) {
            self.count += 1;
        }
    }
}

impl<'ast> Visit<'ast> for Counter {
    fn visit_item(&mut self, item: &'ast Item) {
        match item {
            Item::Const(item) => self.add(&item.vis),
            Item::Enum(item) => self.add(&item.vis),
            Item::Fn(item) => self.add(&item.vis),
            Item::Mod(item) => self.add(&item.vis),
            Item::Static(item) => self.add(&item.vis),
            Item::Struct(item) => self.add(&item.vis),
            Item::Trait(item) => self.add(&item.vis),
            Item::Type(item) => self.add(&item.vis),
            Item::Union(item) => self.add(&item.vis),
            Item::Use(item) => self.add(&item.vis),
            _ => {}
        }
        visit::visit_item(self, item);
    }

    fn visit_field(&mut self, field: &'ast Field) {
        self.add(&field.vis);
    }

    fn visit_item_impl(&mut self, block: &'ast ItemImpl) {
        for item in &block.items {
            match item {
                ImplItem::Fn(method) => self.add(&method.vis),
                ImplItem::Const(constant) => self.add(&constant.vis),
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::functions::testing::member;

    #[test]
    fn only_what_is_public_in_a_library_counts() {
        let text = "pub mod a;\npub use b::{C, D};\npub struct S { pub field: u8 }\n\
                    impl S { pub fn f() {} fn g() {} pub(crate) fn h() {} pub const K: u8 = 1; }\n\
                    pub trait T { fn i(); fn j(); }\ntrait U { fn k(); }\npub(super) fn l() {}\n";
        let small = member(&[("src/lib.rs", text), ("src/a.rs", "pub const A: u8 = 1;")]);
        assert_eq!(count(&small), 8);
        assert_eq!(count(&member(&[("src/main.rs", text)])), 0);
    }
}
