/// Makes the closed set of one concept from its list: the enum, its plugin tables, its reader, and a macro that
/// dispatches a call to whichever member it is.
///
/// ```text
/// catalogue! { ($)
///     /// A surface's way with light.
///     pub enum Bsdf: Model, each_bsdf { Diffuse(diffuse::Diffuse), Dielectric(dielectric::Dielectric) }
/// }
/// ```
///
/// Each member has the constant `PLUGIN` and `fn read(&Params) -> Result<Self, SceneError>` of [`Described`].
macro_rules! catalogue {
    (($d:tt) $(#[$meta:meta])* pub enum $Enum:ident in $category:expr, $each:ident {
        $($(#[$member_meta:meta])* $Member:ident($Type:ty)),* $(,)?
    }) => {
        $(#[$meta])*
        #[derive(Clone, Debug)]
        pub enum $Enum { $($(#[$member_meta])* $Member($Type)),* }

        impl $Enum {
            /// The manual page of every member, in the order of the list.
            pub const PLUGINS: &'static [&'static $crate::node::Plugin] =
                &[$(&<$Type as $crate::node::Described>::PLUGIN),*];

            /// The manual page of the member that it is.
            #[must_use]
            pub fn plugin(&self) -> &'static $crate::node::Plugin {
                match self { $(Self::$Member(_) => &<$Type as $crate::node::Described>::PLUGIN),* }
            }

            /// Reads an object of this category, all but what [`Params::finish`](crate::node::Params::finish) checks.
            ///
            /// # Errors
            /// If no member has this name, or a parameter is wrong.
            pub fn read_from(params: &$crate::node::Params<'_>) -> Result<Self, $crate::node::SceneError> {
                let name = params.plugin().name;
                $(if name == <$Type as $crate::node::Described>::PLUGIN.name {
                    return <$Type as $crate::node::Described>::read(params).map(Self::$Member);
                })*
                unreachable!("{name} was found in this list")
            }

            /// The view of an object, if this list has its plugin.
            ///
            /// # Errors
            /// If it is of another category, or no member has its name.
            pub fn params(
                document: &$crate::node::Document,
                id: $crate::node::ObjectId,
            ) -> Result<$crate::node::Params<'_>, $crate::node::SceneError> {
                $crate::node::Params::of(document, id, $category, Self::PLUGINS)
            }

            /// Reads an object of this category completely.
            ///
            /// # Errors
            /// If no member has its name, or a parameter is wrong or unknown.
            pub fn read(
                document: &$crate::node::Document,
                id: $crate::node::ObjectId,
            ) -> Result<Self, $crate::node::SceneError> {
                let params = Self::params(document, id)?;
                let read = Self::read_from(&params)?;
                params.finish()?;
                Ok(read)
            }
        }

        $(impl From<$Type> for $Enum {
            fn from(member: $Type) -> Self { Self::$Member(member) }
        })*

        macro_rules! $each {
            ($d value:expr, $d member:ident => $d body:expr) => {
                match $d value { $($Enum::$Member($d member) => $d body),* }
            };
        }
    };
}

pub(crate) use catalogue;
