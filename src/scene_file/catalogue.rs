/// Defines the closed set of plugins of one category from a list: the enum, its plugin tables and its reader. The enum
/// forwards trait methods to its members.
///
/// ```text
/// catalogue! {
///     /// A surface's way with light.
///     pub enum Bsdf: BsdfModel in Category::Bsdf { Diffuse(Diffuse), Dielectric(Glass<Dielectric>) }
/// }
/// ```
///
/// Each member has the constant `PLUGIN` and `fn read(&Params) -> Result<Self, SceneError>` of
/// [`Described`](super::Described), and implements the traits. The traits have the attribute `#[enum_dispatch]`, which
/// forwards every method, including those with a default, and converts each member into the enum. Without a trait the
/// macro generates neither.
macro_rules! catalogue {
    ($(#[$meta:meta])* pub enum $Enum:ident $(: $Model:ident $(+ $More:ident)*)? in $category:expr, {
        $($(#[$member_meta:meta])* $Member:ident($Type:ty)),* $(,)?
    }) => {
        $(#[$meta])*
        $(#[::enum_dispatch::enum_dispatch($Model $(, $More)*)])?
        #[derive(Clone, Debug)]
        pub enum $Enum { $($(#[$member_meta])* $Member($Type)),* }

        $crate::scene_file::catalogue! { @read $Enum in $category, { $($Member($Type)),* } }
    };
    // The form with a macro that matches, for methods that must be inlined.
    (($d:tt) $(#[$meta:meta])* pub enum $Enum:ident: $Model:ident $(+ $More:ident)* in $category:expr, $each:ident {
        $($(#[$member_meta:meta])* $Member:ident($Type:ty)),* $(,)?
    }) => {
        $crate::scene_file::catalogue! {
            $(#[$meta])* pub enum $Enum: $Model $(+ $More)* in $category, {
                $($(#[$member_meta])* $Member($Type)),*
            }
        }

        $crate::scene_file::catalogue! { @each ($d) $Enum, $each { $($Member),* } }
    };
    (@each ($d:tt) $Enum:ident, $each:ident { $($Member:ident),* }) => {
        macro_rules! $each {
            ($d value:expr, $d member:ident => $d body:expr) => {
                match $d value { $($Enum::$Member($d member) => $d body),* }
            };
        }
    };
    (@read $Enum:ident in $category:expr, { $($Member:ident($Type:ty)),* }) => {
        impl $Enum {
            /// The manual page of every member, in the order of the list.
            pub const PLUGINS: &'static [&'static $crate::scene_file::Plugin] =
                &[$(&<$Type as $crate::scene_file::Described>::PLUGIN),*];

            /// The manual page of this member.
            #[must_use]
            pub fn plugin(&self) -> &'static $crate::scene_file::Plugin {
                match self { $(Self::$Member(_) => &<$Type as $crate::scene_file::Described>::PLUGIN),* }
            }

            /// Reads an object of this category. [`Params::finish`](crate::scene_file::Params::finish) does the
            /// remaining checks.
            ///
            /// # Errors
            /// If no member has the object's name, or a parameter is wrong.
            pub fn read_from(params: &$crate::scene_file::Params<'_>) -> Result<Self, $crate::scene_file::SceneError> {
                let name = params.plugin().name;
                $(if name == <$Type as $crate::scene_file::Described>::PLUGIN.name {
                    return <$Type as $crate::scene_file::Described>::read(params).map(Self::$Member);
                })*
                unreachable!("{name} was found in this list")
            }

            /// The view of an object, if this list has its plugin.
            ///
            /// # Errors
            /// If the object is of another category, or no member has its name.
            pub fn params(
                document: &$crate::scene_file::Document,
                id: $crate::scene_file::ObjectId,
            ) -> Result<$crate::scene_file::Params<'_>, $crate::scene_file::SceneError> {
                $crate::scene_file::Params::of(document, id, $category, Self::PLUGINS)
            }

            /// Reads an object of this category completely.
            ///
            /// # Errors
            /// If no member has the object's name, or a parameter is wrong or unknown.
            pub fn read(
                document: &$crate::scene_file::Document,
                id: $crate::scene_file::ObjectId,
            ) -> Result<Self, $crate::scene_file::SceneError> {
                let params = Self::params(document, id)?;
                let read = Self::read_from(&params)?;
                params.finish()?;
                Ok(read)
            }
        }
    };
}

pub(crate) use catalogue;
