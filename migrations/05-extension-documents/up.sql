-- The extension rows name the document of the format, in the repository of overfly. No permanent URL of it exists.

UPDATE gpkg_extensions SET definition = 'overfly migrations/README.md' WHERE extension_name = 'overfly_store';
