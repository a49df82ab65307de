"""Pictures, the report page and notebook views of meshes."""

__all__: list[str] = []
