import type { Said } from '../en/messages';

// Titles, usual causes and ways out, by the codes of the service.
export const refusals: Record<string, Said> = {
  unreachable_waypoint: {
    title: 'Ein Wegpunkt ist nicht erreichbar',
    cause: 'Die Pose liegt weiter weg, als der Arm reicht, oder ihre Orientierung ist dort nicht möglich.',
    remedy: 'Die nächste erreichbare Pose nehmen, Richtungen mit einem Toleranzbereich freigeben oder das Werkstück versetzen.',
  },
  joint_position_limit: {
    title: 'Ein Gelenk käme an seine Positionsgrenze',
    cause: 'Auf einer Bewegung des Werkzeugs oder zwischen Wegpunkten müsste ein Gelenk seinen Bereich verlassen.',
    remedy: 'Eine andere Konfiguration des Wegpunkts wählen oder die Bahn verschieben.',
  },
  configuration_change: {
    title: 'Eine Bewegung würde die Konfiguration des Arms wechseln',
    cause: 'Eine Bewegung des Werkzeugs endet in einer anderen Konfiguration, als der Wegpunkt verlangt.',
    remedy: 'Die Konfiguration offen lassen oder mit einer Gelenkbewegung dorthin fahren.',
  },
  singular_path: {
    title: 'Eine Bewegung führt durch eine Singularität',
    cause: 'Auf einer Bewegung des Werkzeugs geht in einer Gelenkstellung eine Richtung des Werkzeugs verloren.',
    remedy: 'Eine Gelenkbewegung nehmen, die Bahn verschieben oder eine Drehung des Werkzeugs freigeben.',
  },
  missing_dynamics: {
    title: 'Der Roboter hat keine Massen',
    cause: 'Die Anfrage braucht Drehmomente, und das Modell des Roboters nennt keine Massen.',
    remedy: 'Dem Modell Massen geben, oder Grenzen der Drehmomente und das Verfahren min_effort weglassen.',
  },
  payload_exceeded: {
    title: 'Die Nutzlast ist zu schwer',
    cause: 'Die Nutzlast ist schwerer, als der Hersteller erlaubt.',
    remedy: 'Weniger tragen oder einen anderen Roboter nehmen.',
  },
  infeasible_duration: {
    title: 'Eine Dauer ist zu kurz für die Grenzen',
    cause: 'Die verlangte Dauer ist kürzer, als die Grenzen erlauben.',
    remedy: 'Eine längere Dauer nehmen oder sie weglassen.',
  },
  limits_unsatisfiable: {
    title: 'Die Grenzen lassen sich nicht einhalten',
    cause: 'Keine Dauer hält eine der Grenzen ein: Schon die Schwerkraft braucht mehr Drehmoment, oder ein Wert ist zu hoch vorgegeben.',
    remedy: 'Die Grenze erweitern, die Nutzlast verringern oder eine andere Gelenkstellung wählen.',
  },
  start_in_collision: {
    title: 'Der Roboter beginnt in einer Kollision',
    cause: 'Am ersten Wegpunkt ist der Roboter einem Objekt oder sich selbst näher, als der Abstand erlaubt.',
    remedy: 'Szene oder Start berichtigen, den Abstand verringern oder das Paar erlauben.',
  },
  collision: {
    title: 'Der Roboter würde kollidieren',
    cause: 'Eine Bewegung oder ein Wegpunkt kommt einem Objekt näher, als der Abstand erlaubt.',
    remedy: 'Eine Bewegung um Hindernisse wählen oder den Abstand verringern.',
  },
  clearance_unproved: {
    title: 'Der Abstand ließ sich nicht beweisen',
    cause: 'Die Bewegung bleibt etwas sehr nah; der Beweis war nicht zu Ende, als sein Rechenaufwand erreicht war.',
    remedy: 'Mehr Abstand halten oder die Formen vereinfachen.',
  },
  no_path_found: {
    title: 'Kein kollisionsfreier Weg wurde gefunden',
    cause: 'Die Suche nach einem Weg um die Hindernisse endete ohne Ergebnis.',
    remedy: 'Einen Wegpunkt unterwegs hinzufügen, mehr Prüfungen erlauben oder Hindernisse versetzen.',
  },
  unsupported_format: {
    title: 'Das Format kann diesen Plan nicht aufnehmen',
    cause: 'Das Format verlangt etwa sechs Gelenke oder ein Ende in Ruhe.',
    remedy: 'Ein anderes Format wählen.',
  },
  invalid_request: {
    title: 'Die Anfrage ist nicht gültig',
    cause: 'Ein Feld fehlt, ist unbekannt oder liegt außerhalb seines Bereichs.',
    remedy: 'Die genannten Felder berichtigen.',
  },
  malformed_request: {
    title: 'Das ist keine HTTP-Anfrage',
    cause: 'Auf der Verbindung kam etwas anderes als HTTP an, etwa TLS an einem Anschluss ohne TLS.',
    remedy: 'Schema und Anschluss der Adresse prüfen.',
  },
  invalid_robot_model: {
    title: 'Das Robotermodell ist nicht brauchbar',
    cause: 'Das hochgeladene Modell hat die genannten Fehler.',
    remedy: 'Das Modell nach den Befunden berichtigen.',
  },
  not_found: {
    title: 'Hier ist nichts',
    cause: 'Keine Operation hat diesen Pfad.',
    remedy: 'Den Pfad mit der Beschreibung unter „API“ vergleichen.',
  },
  method_not_allowed: {
    title: 'Dieser Pfad hat diese Methode nicht',
    cause: 'Der Pfad hat andere Methoden.',
    remedy: 'Eine der erlaubten Methoden verwenden.',
  },
  not_acceptable: {
    title: 'Dieses Format gibt es nicht',
    cause: 'Die Operation kennt das verlangte Format nicht.',
    remedy: 'Eines der Formate unter „Export“ wählen.',
  },
  unsupported_media_type: {
    title: 'Der Inhalt der Anfrage muss JSON sein',
    cause: 'Der Inhalt ist nicht als JSON ausgewiesen.',
    remedy: 'Ihn mit „Content-Type: application/json“ senden.',
  },
  unauthorized: {
    title: 'Hierfür ist ein gültiger Schlüssel nötig',
    cause: 'Die Anfrage hat keinen Schlüssel, oder er ist unbekannt oder widerrufen.',
    remedy: 'Oben einen gültigen Schlüssel eingeben.',
  },
  forbidden: {
    title: 'Der Schlüssel erlaubt das nicht',
    cause: 'Dem Schlüssel fehlt die Berechtigung für diese Operation.',
    remedy: 'Einen Schlüssel mit dieser Berechtigung verwenden.',
  },
  foreign_origin: {
    title: 'Die sendende Seite gehört zu einer anderen Website',
    cause: 'Eine Seite einer anderen Website hat die Anfrage gesendet.',
    remedy: 'Ihre Herkunft in PLANNER_CORS_ORIGINS aufnehmen.',
  },
  misdirected_request: {
    title: 'Der Dienst hat einen anderen Namen',
    cause: 'Die Anfrage nennt im Kopf „Host“ einen Namen, den der Dienst nicht hat.',
    remedy: 'Den Namen in PLANNER_ALLOWED_HOSTS aufnehmen.',
  },
  unknown_robot: {
    title: 'Diesen Roboter gibt es nicht',
    cause: 'Kein Roboter hat diese Kennung, oder er gehört zu einem anderen Schlüssel.',
    remedy: 'Oben einen Roboter auswählen oder ihn hochladen.',
  },
  robot_exists: {
    title: 'Ein anderer Roboter hat diese Kennung',
    cause: 'Ein eigener oder ein öffentlicher Roboter hat die Kennung.',
    remedy: 'Eine andere Kennung wählen oder den Roboter löschen.',
  },
  catalogue_robot: {
    title: 'Der Roboter gehört zum Katalog',
    cause: 'Die Kennung gehört zum Katalog.',
    remedy: 'Eine andere Kennung wählen oder einen Roboter davon ableiten.',
  },
  robot_of_another: {
    title: 'Der Roboter gehört jemand anderem',
    cause: 'Ein anderer Schlüssel oder eine andere Adresse hat den Roboter hinzugefügt.',
    remedy: 'Denselben Schlüssel wie beim Hinzufügen verwenden.',
  },
  too_many_robots: {
    title: 'Mehr Roboter lassen sich nicht hinzufügen',
    cause: 'Der Dienst bewahrt nicht mehr Roboter auf.',
    remedy: 'Einen löschen oder PLANNER_MAX_ROBOTS erhöhen.',
  },
  unknown_scene: {
    title: 'Diese Szene gibt es nicht',
    cause: 'Keine Szene hat diese Kennung, oder sie gehört zu einem anderen Schlüssel.',
    remedy: 'Eine Szene der Liste wählen oder eine eigene anlegen.',
  },
  scene_exists: {
    title: 'Eine andere Szene hat diese Kennung',
    cause: 'Die Kennung ist vergeben.',
    remedy: 'Die Szene ändern oder eine andere Kennung wählen.',
  },
  scene_of_another: {
    title: 'Die Szene gehört jemand anderem',
    cause: 'Ein anderer Schlüssel oder eine andere Adresse hat die Szene hinzugefügt.',
    remedy: 'Denselben Schlüssel verwenden oder eine andere Kennung wählen.',
  },
  too_many_scenes: {
    title: 'Mehr Szenen lassen sich nicht aufbewahren',
    cause: 'Der Dienst bewahrt nicht mehr Szenen auf.',
    remedy: 'Eine löschen oder PLANNER_MAX_SCENES erhöhen.',
  },
  unknown_project: {
    title: 'Dieses Projekt gibt es nicht',
    cause: 'Kein Projekt hat diesen Namen mehr, oder es gehört zu einem anderen Schlüssel.',
    remedy: 'Ein Projekt der Liste wählen oder die gezeigte Anfrage speichern.',
  },
  project_changed: {
    title: 'Das Projekt wurde anderswo geändert',
    cause: 'Ein anderer Browser hat das Projekt inzwischen gespeichert oder gelöscht.',
    remedy: 'Das Projekt öffnen und ansehen, dann noch einmal.',
  },
  project_of_another: {
    title: 'Das Projekt gehört jemand anderem',
    cause: 'Ein anderer Schlüssel oder eine andere Adresse hat das Projekt gespeichert.',
    remedy: 'Unter einem anderen Namen speichern.',
  },
  too_many_projects: {
    title: 'Mehr Projekte lassen sich nicht aufbewahren',
    cause: 'Der Dienst bewahrt nicht mehr Projekte auf.',
    remedy: 'Eines löschen oder PLANNER_MAX_PROJECTS erhöhen.',
  },
  unknown_roadmap: {
    title: 'Diese Roadmap gibt es nicht',
    cause: 'Die Szene hat keine Roadmap dieses Roboters.',
    remedy: 'Eine Roadmap der Szene wählen oder eine anlegen.',
  },
  too_many_roadmaps: {
    title: 'Die Szene hat keinen Platz für die Roadmap',
    cause: 'Die Szene hat so viele Roadmaps oder so große, wie sie haben darf.',
    remedy: 'Die Zahl samples verringern, eine Roadmap löschen oder PLANNER_MAX_ROADMAPS_PER_SCENE erhöhen.',
  },
  unknown_batch: {
    title: 'Diesen Stapel gibt es nicht',
    cause: 'Kein Stapel hat diese Kennung, oder seine Aufbewahrung ist abgelaufen.',
    remedy: 'Ihn noch einmal senden; PLANNER_BATCH_RETENTION_DAYS bestimmt die Aufbewahrung.',
  },
  too_many_batches: {
    title: 'Mehr Stapel lassen sich nicht annehmen',
    cause: 'Der Dienst bewahrt nicht mehr Stapel auf.',
    remedy: 'Beendete löschen oder PLANNER_MAX_BATCHES erhöhen.',
  },
  conflict: {
    title: 'Die Anfrage widerspricht einer früheren',
    cause: 'Zwei Anfragen ändern zugleich dasselbe, oder ein Idempotency-Key hat einen anderen Inhalt.',
    remedy: 'Den jetzigen Stand lesen und die Anfrage noch einmal senden.',
  },
  deadline_exceeded: {
    title: 'Die Frist ist abgelaufen',
    cause: 'Die Anfrage hat mehr Zeit gebraucht, als ihre Frist erlaubt.',
    remedy: 'Die Frist der Anfrage verlängern, oder weniger Wegpunkte oder Abtastwerte verlangen.',
  },
  overloaded: {
    title: 'Zu viele Anfragen warten',
    cause: 'Die Warteschlange oder der Speicher für Anfragen ist voll, oder das Warten würde die Frist überschreiten.',
    remedy: 'Nach einigen Sekunden noch einmal versuchen.',
  },
  too_many_requests: {
    title: 'Zu viele eigene Anfragen sind unterwegs',
    cause: 'Das Kontingent des Schlüssels oder der Adresse ist verbraucht.',
    remedy: 'Nach einigen Sekunden noch einmal versuchen.',
  },
  payload_too_large: {
    title: 'Die Anfrage ist zu groß',
    cause: 'Der Inhalt überschreitet eine Grenze des Dienstes.',
    remedy: 'Weniger auf einmal senden oder PLANNER_MAX_BODY_BYTES erhöhen.',
  },
  header_too_large: {
    title: 'Der Kopf der Anfrage ist zu groß',
    cause: 'Die Kopfzeilen überschreiten ihre Grenze.',
    remedy: 'Weniger oder kürzere Kopfzeilen senden.',
  },
  request_timeout: {
    title: 'Die Anfrage kam nicht rechtzeitig an',
    cause: 'Die Übertragung hat zu lange gedauert.',
    remedy: 'Das Netz prüfen oder PLANNER_BODY_TIMEOUT erhöhen.',
  },
  memory_exceeded: {
    title: 'Die Anfrage braucht zu viel Speicher',
    cause: 'Der Rechenprozess hat PLANNER_WORKER_MEMORY_MIB erreicht.',
    remedy: 'Weniger Abtastwerte verlangen oder Netze und Szenen vereinfachen.',
  },
  database_unavailable: {
    title: 'Die Datenbank ist nicht erreichbar',
    cause: 'Die Datenbank antwortet nicht.',
    remedy: 'Später noch einmal versuchen; der Betreiber prüft die Datenbank.',
  },
  internal_error: {
    title: 'Der Dienst hat versagt',
    cause: 'Der Dienst hat einen Fehler.',
    remedy: 'Ihn mit dem Protokoll des Dienstes melden.',
  },
  no_answer: {
    title: 'Der Dienst antwortet nicht',
    cause: 'Der Dienst ist nicht zu erreichen, oder seine Antwort ist nicht lesbar.',
    remedy: 'Die Seite versucht es von selbst wieder.',
  },
};
