"""A scene assembled: loads, contact laws, materials, the discretisation, its states."""
